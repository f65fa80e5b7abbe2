// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstring>
#include <optional>
#include <span>
#include <string>

#include <doctest/doctest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "hil/hil_error.hpp"
#include "hil/program/emulated_device.hpp"
#include "tests/hil/fake_host.hpp"

namespace {

using kerf::HandGreeting;
using kerf::HandTarget;

constexpr int kLook = kerf::kCyclesPerSecond / 20;

/// A hand at its start.
class Ready {
 public:
  Ready() {
    const kerf::OmniCommand on{.motors_on = true};
    emulator.receive(encode(on));
    emulator.advance(2 * kerf::kCyclesPerSecond);
    REQUIRE(emulator.can_be_led());
  }
  kerf::Emulator emulator{kerf::OmniParams{}, kerf::HandScript{}};
};

/// A window's end of the socket.
class FakeWindow {
 public:
  explicit FakeWindow(const std::string& path) : fd_(socket(AF_UNIX, SOCK_SEQPACKET, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    REQUIRE(connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  }
  FakeWindow(const FakeWindow&) = delete;
  FakeWindow& operator=(const FakeWindow&) = delete;
  ~FakeWindow() { close(fd_); }

  [[nodiscard]] std::optional<HandGreeting> greeting() const {
    std::array<std::uint8_t, 64> bytes{};
    const ssize_t size = recv(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (size <= 0) return std::nullopt;
    return kerf::decode_hand_greeting({bytes.data(), static_cast<std::size_t>(size)});
  }
  void send(std::span<const std::uint8_t> bytes) const {
    static_cast<void>(::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT));
  }

 private:
  int fd_;
};

}  // namespace

TEST_CASE("one window leads the hand; a second is told, and may once the first has gone") {
  const kerf::test::SocketPath path("hand");
  kerf::HandServer server(path.text());
  Ready hand;
  kerf::Emulator& emulator = hand.emulator;
  std::optional<FakeWindow> first(path.text());
  server.lead(emulator, kLook);
  CHECK(first->greeting() == HandGreeting::yours);
  const FakeWindow second(path.text());
  server.lead(emulator, kLook);
  CHECK(second.greeting() == HandGreeting::taken);
  first->send(encode(HandTarget{}));
  server.lead(emulator, 1);
  CHECK(server.wishes() == 1);
  first.reset();
  server.lead(emulator, 1);
  const FakeWindow third(path.text());
  server.lead(emulator, kLook);
  CHECK(third.greeting() == HandGreeting::yours);
}

TEST_CASE("what is no wish is dropped and counted, and a flood is taken in parts") {
  const kerf::test::SocketPath path("hand");
  kerf::HandServer server(path.text());
  Ready hand;
  kerf::Emulator& emulator = hand.emulator;
  const FakeWindow window(path.text());
  server.lead(emulator, kLook);
  const auto wish = encode(HandTarget{});
  std::array<std::uint8_t, 200> noise{};
  window.send(noise);
  window.send(std::span(wish).first(20));
  window.send(wish);
  server.lead(emulator, 1);
  CHECK(server.wishes() == 1);
  CHECK(server.refused() == 2);
  for (int i = 0; i < 40; ++i) window.send(wish);
  server.lead(emulator, 1);
  CHECK(server.wishes() == 17);
  for (int i = 0; i < 3; ++i) server.lead(emulator, 1);
  CHECK(server.wishes() > 17);
}

TEST_CASE("a window waits until the hand is at its start") {
  const kerf::test::SocketPath path("hand");
  kerf::HandServer server(path.text());
  kerf::Emulator emulator(kerf::OmniParams{}, kerf::HandScript{});
  const FakeWindow window(path.text());
  server.lead(emulator, kLook);
  CHECK_FALSE(window.greeting());
  emulator.receive(encode(kerf::OmniCommand{.motors_on = true}));
  emulator.advance(2 * kerf::kCyclesPerSecond);
  server.lead(emulator, kLook);
  CHECK(window.greeting() == HandGreeting::yours);
}

TEST_CASE("a place that cannot be is refused by the name of its option") {
  CHECK_THROWS_WITH_AS(kerf::HandServer("/nowhere/at/all"),
                       doctest::Contains("--hand-socket: /nowhere/at/all"), kerf::HilError);
}
