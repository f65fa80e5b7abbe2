// SPDX-License-Identifier: Apache-2.0
// Ports by name, over a socket, over UDP, in lock-step; and the hello before the first packet.
#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <arpa/inet.h>
#include <doctest/doctest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "controller/device/device_driver.hpp"
#include "controller/device/open_port.hpp"
#include "controller/device/port/socket_port.hpp"
#include "hil/front/socket_servers.hpp"
#include "shared/wire/omni.hpp"
#include "tests/device/fake_port.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::ports_test {
namespace {

using kerf::test::error_of;
using kerf::test::FakePort;
using kerf::test::has;
using Bytes = std::vector<std::uint8_t>;
using Buffer = std::array<std::uint8_t, 64>;

const std::atomic<bool> kGoOn{false};

// ---- names ----

std::string open_error(const std::string& text, Personality personality) {
  return error_of([&] {
    static_cast<void>(
        kerf::open_port(kerf::resolve_port(text, personality), {personality}, 0, kGoOn));
  });
}

}  // namespace

TEST_CASE("a port that is none is refused with the ones that are") {
  for (const char* text : {"auto", "fw", "fw:/dev/fw1", "socket:/tmp/x", "udp:10.0.0.2:5000"}) {
    CAPTURE(text);
    CHECK_NOTHROW(kerf::check_port(text));
  }
  for (const char* text : {"", "usbx", "hid0", "fwd", "sock:/tmp/x", "automatic"}) {
    CAPTURE(text);
    CHECK(
        has(error_of([&] { kerf::check_port(text); }), "use auto, fw, usb, hid, arm, or socket:"));
  }
}

TEST_CASE("auto is the bus of the device") {
  CHECK(kerf::resolve_port("auto", Personality::omni) == "fw");
  CHECK(kerf::resolve_port("auto", Personality::falcon) == "usb");
  CHECK(kerf::resolve_port("auto", Personality::woodenhaptics) == "hid");
  CHECK(kerf::resolve_port("hid:KERF0001", Personality::woodenhaptics) == "hid:KERF0001");
  CHECK(kerf::resolve_port("socket:/tmp/x", Personality::falcon) == "socket:/tmp/x");
  CHECK(has(
      error_of([] { static_cast<void>(kerf::resolve_port("usb,firmware=x", Personality::omni)); }),
      "not for --device omni; take fw"));
}

TEST_CASE("--port usb and hid: options, and the message if no device can be there") {
  struct {
    const char* text;
    Personality personality;
    const char* part;
  } const cases[] = {
      {"usb:/nowhere/1", Personality::falcon, "--port usb:/nowhere/1: no such node; "},
      {"usb:KERF0009", Personality::falcon, "no Falcon (0403:cb48) with this serial number"},
      {"usb:/dev/null", Personality::falcon, "--port usb:/dev/null: is no USB device ("},
      {"usb:/,firmware=/nowhere", Personality::falcon, "--port usb:/: firmware /nowhere: "},
      {"auto", Personality::falcon, "--port usb: no Falcon"},
      {"hid:/nowhere/0", Personality::woodenhaptics, "--port hid:/nowhere/0: no such node; "},
      {"hid:/dev/null", Personality::woodenhaptics, "/dev/null is another device"},
      {"auto", Personality::woodenhaptics, "--port hid: no WoodenHaptics arm"},
  };
  const auto left_out = [](const char* bus) {
    return has(error_of([&] { kerf::check_port(bus); }), "left out of this build; install lib");
  };
  const bool no_usb = left_out("usb"), no_hid = left_out("hid");
  for (const auto& [text, personality, part] : cases) {
    if (personality == Personality::falcon ? no_usb : no_hid) continue;
    CAPTURE(text);
    CHECK(has(open_error(text, personality), part));
  }
  if (!no_usb) {
    CHECK_NOTHROW(kerf::check_port("usb:KERF0001,firmware=/tmp/x"));
    CHECK_NOTHROW(kerf::check_port("usb,firmware=/tmp/x"));
    CHECK(has(error_of([] { kerf::check_port("usb:KERF0001,firmware="); }), "firmware=FILE"));
  }
  if (!no_hid) CHECK(has(error_of([] { kerf::check_port("hid:x,y"); }), "'x,y' is not known"));
}

// ---- a socket ----

namespace {

/// A listening SEQPACKET socket in a folder of its own.
struct Listener {
  Listener() : path(folder / "port") {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strcpy(address.sun_path, path.c_str());
    REQUIRE(bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
    REQUIRE(listen(fd, 1) == 0);
  }
  ~Listener() { close(fd); }
  kerf::test::TemporaryFolder folder;
  std::string path;
  int fd = socket(AF_UNIX, SOCK_SEQPACKET, 0);
};

}  // namespace

TEST_CASE("over a socket packets keep their borders both ways, and the end shows") {
  const Listener listener;
  kerf::SocketPort port(listener.path, 0, kGoOn);
  const int peer = accept(listener.fd, nullptr, nullptr);
  REQUIRE(peer >= 0);
  Buffer buffer{};
  CHECK(port.receive(buffer) == 0);
  CHECK_FALSE(port.wait(0));
  REQUIRE(send(peer, "abc", 3, 0) == 3);
  REQUIRE(send(peer, "de", 2, 0) == 2);
  REQUIRE(send(peer, "0123456789", 10, 0) == 10);
  CHECK(port.wait(100));
  CHECK(port.receive(buffer) == 3);
  CHECK(port.receive(buffer) == 2);
  CHECK(buffer[0] == 'd');
  CHECK(port.receive(std::span(buffer).first(4)) == 10);  // the full size, of a longer packet
  const std::array<std::uint8_t, 2> reply{7, 8};
  CHECK(port.send(reply));
  CHECK(recv(peer, buffer.data(), buffer.size(), 0) == 2);
  CHECK_FALSE(port.closed());
  close(peer);
  CHECK(port.receive(buffer) == 0);
  CHECK(port.closed());
  CHECK_FALSE(port.send(reply));
}

TEST_CASE("a socket on which no process listens is one line that names the way out") {
  const std::string line =
      error_of([] { const kerf::SocketPort port("/nonexistent/port", 0, kGoOn); });
  CHECK(has(line, "/nonexistent/port"));
  CHECK(has(line, "kerf-emulator"));
  CHECK_FALSE(has(line, "\n"));
  CHECK_THROWS_AS(kerf::SocketPort(std::string(200, 'x'), 0, kGoOn), std::runtime_error);
}

// ---- UDP ----

TEST_CASE("over UDP packets keep their borders both ways, and the end shows on both sides" *
          doctest::test_suite("network")) {
  kerf::UdpServer server("0");
  std::optional<kerf::UdpPort> port;
  port.emplace(std::to_string(server.port()), 0, kGoOn);
  auto link = server.accept(kGoOn);  // greeted
  REQUIRE(link.has_value());
  Buffer buffer{};
  CHECK(port->receive(buffer) == 0);
  CHECK_FALSE(port->closed());
  CHECK(link->send(std::array<std::uint8_t, 3>{1, 2, 3}) == kerf::PacketLink::Sent::yes);
  CHECK(link->send(std::array<std::uint8_t, 2>{4, 5}) == kerf::PacketLink::Sent::yes);
  CHECK(port->wait(1000));
  CHECK(port->receive(buffer) == 3);
  CHECK(port->receive(buffer) == 2);
  CHECK(buffer[0] == 4);
  CHECK(port->send(std::array<std::uint8_t, 2>{7, 8}));
  CHECK(link->wait(buffer, 1000).size() == 2);

  SUBCASE("a port that is destroyed sends its end") {
    port.reset();
    CHECK(link->wait(buffer, 1000).empty());
    CHECK(link->closed());
  }
  SUBCASE("an empty datagram is the device's end") {
    CHECK(link->send({}) == kerf::PacketLink::Sent::yes);
    CHECK(port->wait(1000));
    CHECK(port->receive(buffer) == 0);
    CHECK(port->closed());
    CHECK(port->send(std::array<std::uint8_t, 1>{1}));  // motors off, for a device that listens
  }
}

TEST_CASE("over UDP a device that is killed closes the port" * doctest::test_suite("network")) {
  std::optional<kerf::UdpServer> server;
  server.emplace("0");
  kerf::UdpPort port(std::to_string(server->port()), 0, kGoOn);
  server.reset();
  // The refusal of one packet is reported by the next call.
  Buffer buffer{};
  for (int tries = 0; tries < 100 && !port.closed(); ++tries) {
    port.send(std::array<std::uint8_t, 1>{1});
    CHECK(port.receive(buffer) == 0);
  }
  CHECK(port.closed());
}

// ---- a device that ends the link with torque on its motors ----

namespace {

/// A host over a socket or UDP, and the device's end of it as a bare descriptor.
struct TorqueLink {
  explicit TorqueLink(bool over_udp) : udp(over_udp) {
    if (!udp) {
      port = std::make_unique<kerf::SocketPort>(listener.path, 0, kGoOn);
      peer = accept(listener.fd, nullptr, nullptr);
    } else {
      peer = bound();
      port = std::make_unique<kerf::UdpPort>(std::to_string(number), 0, kGoOn);
      char greeting = 0;
      socklen_t bytes = sizeof host;
      REQUIRE(recvfrom(peer, &greeting, 1, 0, as_address(host), &bytes) == 0);
      REQUIRE(connect(peer, as_address(host), bytes) == 0);
    }
    driver = kerf::make_driver(Personality::omni, *port);
  }
  ~TorqueLink() { close(peer); }

  static sockaddr* as_address(sockaddr_in& address) {
    return reinterpret_cast<sockaddr*>(&address);
  }
  /// A descriptor at the device's port, the first time a free one.
  int bound() {
    const int fd = socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    own.sin_port = htons(number);
    socklen_t bytes = sizeof own;
    REQUIRE(bind(fd, as_address(own), bytes) == 0);
    REQUIRE(getsockname(fd, as_address(own), &bytes) == 0);
    number = ntohs(own.sin_port);
    return fd;
  }
  void tick() {
    static_cast<void>(driver->read());
    kerf::ServoOutput output;
    output.dac_counts = {100, -100, 100};
    output.motors_on = true;
    driver->command(output);
  }
  /// The commands that wait at the device.
  [[nodiscard]] std::vector<kerf::OmniCommand> commands() const {
    std::vector<kerf::OmniCommand> all;
    Buffer packet{};
    for (ssize_t size = 0; (size = recv(peer, packet.data(), packet.size(), MSG_DONTWAIT)) > 0;) {
      all.push_back(
          kerf::decode_command(std::span(packet).first(static_cast<std::size_t>(size))).value());
    }
    return all;
  }

  Listener listener;
  bool udp;
  std::uint16_t number = 0;
  sockaddr_in host{};
  int peer = -1;
  std::unique_ptr<kerf::PacketPort> port;
  std::unique_ptr<kerf::DeviceDriver> driver;
};

void check_off(const std::vector<kerf::OmniCommand>& commands) {
  CHECK_FALSE(commands.empty());
  for (const auto& command : commands) {
    CHECK_FALSE(command.motors_on);
    CHECK(command.motor == kerf::OmniCommand{}.motor);
  }
}

}  // namespace

TEST_CASE("however the device ends the link, all that it hears from then on is: motors off" *
          doctest::test_suite("network")) {
  struct {
    bool udp;
    void (*end)(int peer);
  } const ends[] = {{false, [](int peer) { shutdown(peer, SHUT_WR); }},
                    {false, [](int peer) { send(peer, nullptr, 0, 0); }},
                    {true, [](int peer) { send(peer, nullptr, 0, 0); }}};
  for (const auto& [udp, end] : ends) {
    CAPTURE(udp);
    for (std::uint32_t moment = 1; moment <= 20; ++moment) {
      TorqueLink link(udp);
      for (std::uint32_t i = 1; i <= moment; ++i) {
        const auto report = kerf::encode(kerf::OmniReport{.counter = i});
        REQUIRE(send(link.peer, report.data(), report.size(), 0) > 0);
        if (i % 3 != 0) link.tick();  // some wait when the end comes
      }
      CHECK(link.commands().back().motors_on);
      end(link.peer);
      for (int tick = 0; tick < 3; ++tick) link.tick();
      check_off(link.commands());
      CHECK(link.port->closed());
      CHECK(link.driver->release());
      link.port.reset();
      check_off(link.commands());
    }
  }
}

TEST_CASE("over UDP the refusal of a packet does not cost the next one, which is: motors off" *
          doctest::test_suite("network")) {
  for (const bool by_watchdog : {false, true}) {
    TorqueLink link(true);
    link.tick();
    close(link.peer);
    link.tick();  // refused
    link.peer = link.bound();
    if (by_watchdog) {
      CHECK(link.driver->release());
    } else {
      link.tick();
    }
    check_off(link.commands());
  }
}

TEST_CASE("a UDP address that is none, or answers nothing, is one line that names the way out") {
  const std::string free_port = [] { return std::to_string(kerf::UdpServer("0").port()); }();
  for (const std::string& where :
       {free_port, std::string("127.0.0.1:99999"), std::string(), std::string("[::1]:x")}) {
    CAPTURE(where);
    const std::string line = error_of([&] { const kerf::UdpPort port(where, 0, kGoOn); });
    CHECK(line.starts_with("--port udp:" + where + ": "));
    CHECK(has(line, "; name the [ADDRESS:]PORT of kerf-emulator --front udp"));
  }
}

// ---- lock-step: all packets of a tick are one turn ----

namespace {

struct Line {
  Line() {
    auto fake = std::make_unique<FakePort>();
    end = fake.get();
    port = std::make_unique<kerf::LockStepPort>(std::move(fake));
  }
  [[nodiscard]] Bytes take() const {
    Buffer out{};
    const std::size_t size = port->receive(out);
    return {out.begin(), out.begin() + static_cast<std::ptrdiff_t>(std::min(size, out.size()))};
  }
  FakePort* end = nullptr;
  std::unique_ptr<kerf::LockStepPort> port;
};

Bytes turn_of(const std::vector<Bytes>& packets) {
  Turn turn;
  for (const Bytes& packet : packets) REQUIRE(turn.add(packet));
  return {turn.bytes().begin(), turn.bytes().end()};
}

}  // namespace

TEST_CASE("the packets of a turn come one by one, those of the next only after a wait") {
  const Line line;
  line.end->push(Bytes{'k', 'e', 'r', 'f'});  // without a turn
  line.end->push(turn_of({{1, 2, 3}, {4}}));
  line.end->push(turn_of({}));
  line.end->push(turn_of({{5, 6}}));
  CHECK(line.take() == Bytes{'k', 'e', 'r', 'f'});
  CHECK(line.port->wait(0));
  CHECK(line.take() == Bytes{1, 2, 3});
  CHECK(line.take() == Bytes{4});
  CHECK(line.take().empty());
  CHECK(line.take().empty());  // however long the next turn has been there
  CHECK(line.port->wait(0));
  CHECK(line.take().empty());  // nothing came in this tick
  CHECK(line.port->wait(0));
  CHECK(line.take() == Bytes{5, 6});
  CHECK_FALSE(line.port->wait(0));
}

TEST_CASE("a broken turn gives its whole packets and reads nothing beyond") {
  const Line line;
  Bytes cut = turn_of({{1, 2}, {3, 4, 5}});
  cut.pop_back();
  line.end->push(cut);
  CHECK(line.port->wait(0));
  CHECK(line.take() == Bytes{1, 2});
  CHECK(line.take().empty());
  Bytes bare(Turn::kMagic.begin(), Turn::kMagic.end());
  bare.push_back(0);
  line.end->push(bare);
  CHECK(line.port->wait(0));
  CHECK(line.take().empty());
}

TEST_CASE("a turn takes packets that fit and refuses the rest whole") {
  Turn turn;
  CHECK_FALSE(turn.add(Bytes{}));
  CHECK_FALSE(turn.add(Bytes(256, 1)));
  int added = 0;
  while (turn.add(Bytes(64, 1))) ++added;
  CHECK(added == 15);
  CHECK(turn.bytes().size() <= Turn::kMostBytes);
  CHECK(turn.add(Bytes(8, 2)));  // there is still room for a shorter one
}

// ---- the hello ----

namespace {

constexpr LinkHello kOurs{Personality::omni, true, 1000};

std::string refusal_of(FakePort& port, int patience_ms, const std::atomic<bool>& stop = kGoOn) {
  return error_of([&] { agree(port, "--port x", kOurs, true, patience_ms, stop); });
}

}  // namespace

TEST_CASE("the hello goes first, and packets of the device before the answer are dropped") {
  FakePort port;
  const auto early = encode(kerf::OmniReport{});
  port.push(early);
  port.push(Bytes(64, 7));
  port.push(encode(kOurs));
  port.push(early);  // of the session
  CHECK(refusal_of(port, 5000).empty());
  REQUIRE(port.sent.size() == 1);
  CHECK(kerf::decode_hello(port.sent[0]) == kOurs);
  CHECK(port.incoming.size() == 1);
}

TEST_CASE("a partner that does not fit, has ended or does not answer is refused") {
  FakePort other;
  other.push(encode(LinkHello{Personality::falcon, true, 1000}));
  CHECK(refusal_of(other, 5000).starts_with("--port x: the controller wants a device omni"));
  FakePort ended;  // after another client
  ended.gone = true;
  CHECK(has(refusal_of(ended, 5000), "--stay"));
  FakePort mute;
  CHECK(refusal_of(mute, 450).starts_with("--port x: no answer to the hello"));
  CHECK(mute.sent.size() >= 2);
  CHECK(mute.sent.size() <= 3);  // each 0.2 s
  const std::atomic<bool> stop{true};
  CHECK(has(refusal_of(mute, 60000, stop), "no answer"));
}

}  // namespace kerf::ports_test
