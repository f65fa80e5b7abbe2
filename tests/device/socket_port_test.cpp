// SPDX-License-Identifier: Apache-2.0
#include "controller/device/port/socket_port.hpp"

#include <array>
#include <cstring>
#include <filesystem>
#include <string>

#include <doctest/doctest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace {

const std::atomic<bool> kGoOn{false};

/// A listening SEQPACKET socket in a folder of its own.
struct Listener {
  Listener() {
    std::string folder = (std::filesystem::temp_directory_path() / "kerf-port-XXXXXX").string();
    REQUIRE(mkdtemp(folder.data()) != nullptr);
    path = std::filesystem::path(folder) / "port";
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strcpy(address.sun_path, path.c_str());
    fd = socket(AF_UNIX, SOCK_SEQPACKET, 0);
    REQUIRE(bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
    REQUIRE(listen(fd, 1) == 0);
  }
  ~Listener() {
    close(fd);
    std::filesystem::remove_all(path.parent_path());
  }
  std::filesystem::path path;
  int fd = -1;
};

}  // namespace

TEST_CASE("packets keep their borders both ways, and the end shows") {
  const Listener listener;
  kerf::SocketPort port(listener.path, 0, kGoOn);
  const int peer = accept(listener.fd, nullptr, nullptr);
  REQUIRE(peer >= 0);

  std::array<std::uint8_t, 64> buffer{};
  CHECK(port.receive(buffer) == 0);
  CHECK_FALSE(port.wait(0));
  REQUIRE(send(peer, "abc", 3, 0) == 3);
  REQUIRE(send(peer, "de", 2, 0) == 2);
  CHECK(port.wait(100));
  CHECK(port.receive(buffer) == 3);
  CHECK(port.receive(buffer) == 2);
  CHECK(buffer[0] == 'd');
  const std::array<std::uint8_t, 2> reply{7, 8};
  CHECK(port.send(reply));
  CHECK(recv(peer, buffer.data(), buffer.size(), 0) == 2);

  CHECK_FALSE(port.closed());
  close(peer);
  CHECK(port.receive(buffer) == 0);
  CHECK(port.closed());
  CHECK_FALSE(port.send(reply));
}

TEST_CASE("a packet longer than the buffer shows its full size") {
  const Listener listener;
  kerf::SocketPort port(listener.path, 0, kGoOn);
  const int peer = accept(listener.fd, nullptr, nullptr);
  REQUIRE(send(peer, "0123456789", 10, 0) == 10);
  std::array<std::uint8_t, 4> buffer{};
  CHECK(port.receive(buffer) == 10);
  close(peer);
}

TEST_CASE("nobody listening is one line that names the way out") {
  try {
    const kerf::SocketPort port("/nonexistent/port", 0, kGoOn);
    FAIL("connected to nothing");
  } catch (const std::runtime_error& error) {
    const std::string line = error.what();
    CHECK(line.find("/nonexistent/port") != std::string::npos);
    CHECK(line.find("kerf-emulator") != std::string::npos);
    CHECK(line.find('\n') == std::string::npos);
  }
  CHECK_THROWS_WITH_AS(kerf::SocketPort(std::string(200, 'x'), 0, kGoOn),
                       doctest::Contains("use a shorter one"), std::runtime_error);
}
