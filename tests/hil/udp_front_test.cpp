// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <arpa/inet.h>
#include <doctest/doctest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "hil/device/emulator.hpp"
#include "hil/device/falcon.hpp"
#include "hil/front/serving.hpp"
#include "hil/front/socket_servers.hpp"
#include "hil/hil_error.hpp"
#include "shared/posix/monotonic_clock.hpp"

namespace {

using kerf::Emulator;
using kerf::FrontStats;
using kerf::UdpServer;
using Bytes = std::vector<std::uint8_t>;

/// A host on this machine.
class UdpHost {
 public:
  explicit UdpHost(std::uint16_t port) : fd_(socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(port);
    REQUIRE(connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  }
  UdpHost(const UdpHost&) = delete;
  UdpHost& operator=(const UdpHost&) = delete;
  ~UdpHost() { close(fd_); }

  void send(std::span<const std::uint8_t> packet) const {
    CHECK(::send(fd_, packet.data(), packet.size(), 0) == static_cast<ssize_t>(packet.size()));
  }
  void say_hello_or_goodbye() const { send({}); }

  /// Empty on timeout.
  [[nodiscard]] Bytes receive(int timeout_ms) const {
    pollfd ready{fd_, POLLIN, 0};
    if (poll(&ready, 1, timeout_ms) <= 0) return {};
    Bytes bytes(128);
    const ssize_t size = recv(fd_, bytes.data(), bytes.size(), 0);
    bytes.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    return bytes;
  }

 private:
  int fd_;
};

/// An emulator that serves one host at a free port in its own thread.
template <class Serve>
class Served {
 public:
  Served(Emulator emulator, Serve serve)
      : emulator_(std::move(emulator)), thread_([this, serve] {
          auto host = server_.accept(stop_);
          if (host) serve(*host, emulator_, kerf::ServeLimits{0, stop_}, stats_);
        }) {}
  ~Served() {
    stop_ = true;
    join();
  }
  void join() {
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] std::uint16_t port() const { return server_.port(); }
  [[nodiscard]] const FrontStats& stats() const { return stats_; }
  [[nodiscard]] const Emulator& emulator() const { return emulator_; }

 private:
  Emulator emulator_;
  FrontStats stats_;
  std::atomic<bool> stop_{false};
  UdpServer server_{"0"};
  std::thread thread_;
};

const auto kLockstep = [](auto& host, auto& device, const auto& limits, auto& stats) {
  kerf::serve_lockstep(host, device, {.tick_cycles = 8}, limits, stats);
};
const auto kRealTime = [](auto& host, auto& device, const auto& limits, auto& stats) {
  kerf::serve_real_time(host, device, 4, limits, stats);
};

Emulator omni() {
  return Emulator({}, std::nullopt);
}
Emulator falcon() {
  return Emulator(std::make_unique<kerf::FalconModel>(), std::nullopt);
}

std::string refusal_of(const std::string& where) {
  try {
    const UdpServer server(where);
  } catch (const kerf::HilError& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace

TEST_CASE("over UDP an empty datagram begins a session and ends it") {
  Served served(omni(), kLockstep);
  const UdpHost host(served.port());
  host.say_hello_or_goodbye();
  CHECK(host.receive(5000).size() == kerf::omni::kReportBytes);  // the Omni speaks first
  for (int tick = 0; tick < 100; ++tick) {
    host.send(encode(kerf::OmniCommand{}));
    CHECK(host.receive(5000).size() == kerf::omni::kReportBytes);
  }
  host.say_hello_or_goodbye();
  served.join();
  CHECK(served.stats().cycles == 800);
  CHECK(served.emulator().stats().commands == 100);
}

TEST_CASE("over UDP the first packet of a host counts, and a Falcon answers each one") {
  Served served(falcon(), kLockstep);
  const UdpHost host(served.port());
  for (int tick = 0; tick < 50; ++tick) {
    host.send(encode(kerf::FalconCommand{{}, true, false, false, false}));
    CHECK(kerf::falcon::decode_report(host.receive(5000)).has_value());
  }
  CHECK(host.receive(20).empty());  // and says nothing by itself
  host.say_hello_or_goodbye();
  served.join();
  CHECK(served.emulator().stats().commands == 50);
  CHECK(served.emulator().stats().reports == 50);
}

TEST_CASE("a stranger's datagrams reach nobody and get no answer") {
  Served served(falcon(), kLockstep);
  const UdpHost host(served.port());
  const UdpHost stranger(served.port());
  const auto packet = encode(kerf::FalconCommand{});
  host.send(packet);
  CHECK_FALSE(host.receive(5000).empty());
  for (int i = 0; i < 10; ++i) stranger.send(packet);
  stranger.say_hello_or_goodbye();
  host.send(packet);
  CHECK_FALSE(host.receive(5000).empty());
  CHECK(stranger.receive(20).empty());
  host.say_hello_or_goodbye();
  served.join();
  CHECK(served.emulator().stats().commands == 2);
}

TEST_CASE("in real time over UDP packets come by themselves, until the host is silent for 2 s") {
  Served served(omni(), kRealTime);
  const UdpHost host(served.port());
  const std::int64_t last_word_ns = kerf::monotonic_ns();
  host.say_hello_or_goodbye();
  int packets = 0;
  for (; packets < 200 && !host.receive(1000).empty(); ++packets) {
  }
  CHECK(packets == 200);
  served.join();
  CHECK(kerf::monotonic_ns() - last_word_ns >= 2 * kerf::kNsPerSecond);  // no sooner
  CHECK(served.stats().cycles < 10 * kerf::kCyclesPerSecond);
}

TEST_CASE("a UDP address that cannot be served is refused in one line") {
  const UdpServer taken("0");
  for (const std::string& where :
       {std::to_string(taken.port()), std::string("203.0.113.1:0"), std::string("port"),
        std::string(""), std::string("127.0.0.1:99999"), std::string(":5")}) {
    CAPTURE(where);
    const std::string line = refusal_of(where);
    CAPTURE(line);
    CHECK(line.find("--udp: " + where + ": ") == 0);
    CHECK(line.find("; use [ADDRESS:]PORT") != std::string::npos);
  }
  CHECK(UdpServer("[::1]:0").port() != 0);
}

TEST_CASE("waiting for a UDP host ends with a stop request") {
  UdpServer server("0");
  std::atomic<bool> stop{false};
  std::thread later([&] { stop = true; });
  CHECK_FALSE(server.accept(stop).has_value());
  later.join();
}
