// SPDX-License-Identifier: Apache-2.0
// The emulator behind sockets: SEQPACKET and UDP, in lock-step and in real time, and the hello.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "hil/device/emulator.hpp"
#include "hil/device/falcon.hpp"
#include "hil/front/serving.hpp"
#include "hil/front/socket_servers.hpp"
#include "hil/hil_error.hpp"
#include "hil/script/hand_script_file.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/wire/omni.hpp"
#include "tests/hil/fake_host.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::sockets_test {
namespace {

using kerf::test::FakeHost;
using kerf::test::TemporaryFolder;
using Bytes = std::vector<std::uint8_t>;

/// One emulator that serves one client at `address` in its own thread.
template <class Server>
class Served {
 public:
  Served(const std::string& address, bool lockstep, Emulator emulator)
      : emulator_(std::move(emulator)), server_(address), thread_([this, lockstep] {
          auto client = server_.accept(stop_);
          if (!client) return;
          const kerf::ServeLimits limits{0, stop_};
          if (lockstep) {
            kerf::serve_lockstep(*client, emulator_, {.tick_cycles = 8}, limits, stats_);
          } else {
            kerf::serve_real_time(*client, emulator_, 4, limits, stats_);
          }
        }) {}
  ~Served() {
    stop_ = true;
    join();
  }
  void join() {
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] const Server& server() const { return server_; }
  [[nodiscard]] const FrontStats& stats() const { return stats_; }
  [[nodiscard]] const Emulator& emulator() const { return emulator_; }

 private:
  Emulator emulator_;
  FrontStats stats_;
  std::atomic<bool> stop_{false};
  Server server_;
  std::thread thread_;
};

/// An Omni with a hand behind a SEQPACKET socket.
struct OmniAtSocket : TemporaryFolder, Served<SeqpacketServer> {
  explicit OmniAtSocket(bool lockstep)
      : Served((*this / "socket").string(), lockstep,
               Emulator({}, kerf::read_hand_script(KERF_HANDS "/touch.toml"))),
        host((*this / "socket").string()) {}
  FakeHost host;
};

/// A device without a hand behind UDP.
struct AtPort : Served<UdpServer> {
  AtPort(bool lockstep, Emulator emulator)
      : Served("0", lockstep, std::move(emulator)), host(server().port()) {}
  FakeHost host;
};
Emulator omni() {
  return Emulator({}, std::nullopt);
}
Emulator falcon() {
  return Emulator(std::make_unique<kerf::FalconModel>(), std::nullopt);
}

std::vector<OmniReport> lockstep_session(int ticks) {
  OmniAtSocket served(true);
  FakeHost& host = served.host;
  std::vector<OmniReport> reports;
  for (int tick = 0; tick < ticks; ++tick) {
    const auto report = host.receive();
    if (!report) break;
    reports.push_back(*report);
    host.send({{static_cast<std::int16_t>(tick % 50), 0, 0}, true, OmniCommand::Light::steady});
  }
  CHECK(host.receive().has_value());  // the answer to the last command
  host.leave();
  served.join();
  CHECK(served.stats().cycles == 8 * ticks);
  CHECK(served.emulator().stats().commands == static_cast<std::uint64_t>(ticks));
  return reports;
}

}  // namespace

TEST_CASE("in lock-step each command gets one report, and a second run gets the same ones") {
  const auto first = lockstep_session(2000);
  REQUIRE(first.size() == 2000);
  for (std::size_t i = 0; i < first.size(); ++i) CHECK(first[i].counter == i + 1);
  CHECK(first.front().docked);
  CHECK_FALSE(first.back().docked);  // the hand left meanwhile
  CHECK(lockstep_session(2000) == first);
}

TEST_CASE("in lock-step nothing moves without a command") {
  OmniAtSocket served(true);
  CHECK(served.host.receive().has_value());
  CHECK_FALSE(served.host.receive(250).has_value());
  CHECK_FALSE(served.host.ended());
  served.host.send(OmniCommand{});
  CHECK(served.host.receive().has_value());
}

TEST_CASE("in real time packets come by themselves and commands are applied") {
  OmniAtSocket served(false);
  FakeHost& host = served.host;
  host.send({{100, 100, 100}, true, OmniCommand::Light::steady});
  const std::int64_t begin_ns = kerf::monotonic_ns();
  for (std::uint32_t i = 1; i <= 400; ++i) {
    const auto report = host.receive();
    REQUIRE(report);
    CHECK(report->counter == i);
  }
  CHECK(kerf::monotonic_ns() - begin_ns > 190'000'000);  // 400 packets at 2 kHz cannot be sooner
  host.leave();
  served.join();
  CHECK(served.emulator().stats().commands == 1);
  CHECK(served.emulator().stats().peak_motor_force_n > 0);
  CHECK(served.stats().wake.count() >= 400);
}

TEST_CASE("a client that does not read loses packets, and the device goes on") {
  OmniAtSocket served(false);
  std::this_thread::sleep_for(std::chrono::milliseconds(1000));
  std::uint32_t waiting = 0;
  while (served.host.receive(0)) ++waiting;
  const auto fresh = served.host.receive();
  REQUIRE(fresh);
  CHECK(fresh->counter > waiting + 1);  // there is a gap
  served.host.leave();
  served.join();
  CHECK(served.stats().dropped > 0);
  CHECK(served.stats().cycles >= 2000);
}

TEST_CASE("a server takes over a stale socket, refuses a live one, and removes its own") {
  const TemporaryFolder folder;
  const std::string path = folder / "socket";
  {
    // A listener that ended without cleaning up: the file stays, no process listens.
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    const int dead = socket(AF_UNIX, SOCK_SEQPACKET, 0);
    REQUIRE(bind(dead, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
    close(dead);
  }
  REQUIRE(std::filesystem::exists(path));
  {
    SeqpacketServer server(path);
    CHECK(kerf::test::has(kerf::test::error_of([&] { const SeqpacketServer second(path); }),
                          "--socket: " + path + " is in use by another emulator"));
    // The question has not disturbed the first one: it still serves.
    const FakeHost host(path);
    CHECK(host.connected());
    const std::atomic<bool> stop{false};
    CHECK(server.accept(stop).has_value());
  }
  CHECK_FALSE(std::filesystem::exists(path));
}

TEST_CASE("a path that is no socket, too long or in no folder is refused") {
  const TemporaryFolder folder;
  const std::string path = folder / "socket";
  for (const std::string& file : {path, path + ".new"}) {  // the name until the socket listens
    folder.write(file, "precious");
    CHECK_THROWS_AS(SeqpacketServer{path}, kerf::HilError);
    CHECK(kerf::test::text_of(file) == "precious");
    std::filesystem::remove(file);
  }
  CHECK_NOTHROW(SeqpacketServer{path});
  CHECK_THROWS_AS(SeqpacketServer{std::string(104, 'x')}, kerf::HilError);
  CHECK_THROWS_AS(SeqpacketServer{""}, kerf::HilError);
  CHECK_THROWS_AS(SeqpacketServer{"/nowhere/at/all"}, kerf::HilError);
}

TEST_CASE("waiting for a client ends with a stop request") {
  const TemporaryFolder folder;
  const auto ends = [](auto server) {
    std::atomic<bool> stop{false};
    std::thread later([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      stop = true;
    });
    CHECK_FALSE(server->accept(stop).has_value());
    later.join();
  };
  ends(std::make_unique<SeqpacketServer>(folder / "socket"));
  ends(std::make_unique<UdpServer>("0"));
}

TEST_CASE("a thread without the right to real time gets a message, and goes on") {
  std::string none;
  std::string absent_core;
  std::thread([&] {
    none = kerf::make_real_time(0, 1000);
    absent_core = kerf::make_real_time(1, 1000);
  }).join();
  CHECK(none == "");
  CHECK(absent_core.find("no right to core 1000") == 0);
}

TEST_CASE("over UDP an empty datagram begins a session and ends it" *
          doctest::test_suite("network")) {
  AtPort served(true, omni());
  FakeHost& host = served.host;
  host.send(Bytes{});
  CHECK(host.receive());  // the Omni's packet comes first
  for (int tick = 0; tick < 100; ++tick) {
    host.send(OmniCommand{});
    CHECK(host.receive());
  }
  host.send(Bytes{});
  served.join();
  CHECK(served.stats().cycles == 800);
  CHECK(served.emulator().stats().commands == 100);
}

TEST_CASE(
    "over UDP the first packet of a host counts, and a Falcon answers each one, only its own" *
    doctest::test_suite("network")) {
  AtPort served(true, falcon());
  FakeHost& host = served.host;
  FakeHost stranger(served.server().port());
  const auto packet = encode(kerf::FalconCommand{{}, true, false, false, false});
  for (int tick = 0; tick < 50; ++tick) {
    host.send(packet);
    CHECK(kerf::falcon::decode_report(host.packet()).has_value());
    stranger.send(packet);
  }
  stranger.send(Bytes{});
  CHECK(host.packet(20).empty());  // nothing by itself
  CHECK(stranger.packet(20).empty());
  host.send(Bytes{});
  served.join();
  CHECK(served.emulator().stats().commands == 50);
  CHECK(served.emulator().stats().reports == 50);
}

TEST_CASE("in real time over UDP packets come by themselves, until the host is silent for 2 s" *
          doctest::test_suite("network")) {
  AtPort served(false, omni());
  const std::int64_t last_sent_ns = kerf::monotonic_ns();
  served.host.send(Bytes{});
  int packets = 0;
  while (packets < 200 && served.host.receive(1000)) ++packets;
  CHECK(packets == 200);
  served.join();
  CHECK(kerf::monotonic_ns() - last_sent_ns >= 2 * kerf::kNsPerSecond);  // no sooner
  CHECK(served.stats().cycles < 10 * kerf::kCyclesPerSecond);
}

TEST_CASE("a UDP address that cannot be served is refused in one line" *
          doctest::test_suite("network")) {
  const UdpServer taken("0");
  for (const std::string& where :
       {std::to_string(taken.port()), std::string("203.0.113.1:0"), std::string("port"),
        std::string(""), std::string("127.0.0.1:99999"), std::string(":5")}) {
    CAPTURE(where);
    const std::string line = kerf::test::error_of([&] { const UdpServer server(where); });
    CHECK(line.starts_with("--udp: " + where + ": "));
    CHECK(kerf::test::has(line, "; use [ADDRESS:]PORT"));
  }
  CHECK(UdpServer("[::1]:0").port() != 0);
}

namespace {

using Sent = kerf::PacketLink::Sent;
constexpr LinkHello kOwn{Personality::omni, true, 1000};

/// A client in memory, for which no call waits.
class FakeClient final : public kerf::PacketLink {
 public:
  FakeClient() : PacketLink(open("/dev/null", O_RDWR | O_CLOEXEC)) {}
  FakeClient(const FakeClient&) = delete;
  FakeClient& operator=(const FakeClient&) = delete;
  ~FakeClient() override { close(fd_); }
  std::span<const std::uint8_t> take(std::span<std::uint8_t> buffer) noexcept override {
    if (said.empty()) return {};
    const Bytes packet = said.front();
    said.pop_front();
    std::copy(packet.begin(), packet.end(), buffer.begin());
    return buffer.first(packet.size());
  }
  Sent send(std::span<const std::uint8_t> packet) noexcept override {
    heard.emplace_back(packet.begin(), packet.end());
    return Sent::yes;
  }
  void hang_up() noexcept override {}
  void say(std::span<const std::uint8_t> packet) {
    said.emplace_back(packet.begin(), packet.end());
  }

  std::deque<Bytes> said;
  std::vector<Bytes> heard;
};

struct Meeting {
  FakeClient client;
  HandshakeLink link{client, kOwn};
  std::array<std::uint8_t, 65> buffer{};
};

}  // namespace

TEST_CASE("a hello is answered, the device's last packet follows, and each one again" *
          doctest::test_suite("network")) {
  Meeting m;
  const Bytes first{1, 2, 3};
  const Bytes last{4, 5};
  CHECK(m.link.send(first) == Sent::yes);
  CHECK(m.link.send(last) == Sent::yes);
  m.client.say(encode(kOwn));
  m.client.say(encode(kOwn));  // its answer was lost
  CHECK(m.link.take(m.buffer).empty());
  REQUIRE(m.client.heard.size() == 4);
  CHECK(kerf::decode_hello(m.client.heard[2]) == kOwn);
  CHECK(m.client.heard[3] == last);
  CHECK(m.link.take(m.buffer).empty());
  CHECK(m.client.heard.size() == 6);
  CHECK_FALSE(m.link.closed());
  CHECK(m.link.refusal().empty());
}

TEST_CASE("a hello that does not fit is answered, and the link closes") {
  Meeting m;
  CHECK(m.link.send(Bytes{1}) == Sent::yes);
  m.client.say(encode(LinkHello{Personality::omni, false, 1000}));
  CHECK(m.link.take(m.buffer).empty());
  CHECK(m.link.closed());
  CHECK(m.link.refusal().find("the emulator runs in lock-step") == 0);
  CHECK(kerf::decode_hello(m.client.heard.back()) == kOwn);
}

TEST_CASE("a client without a hello is served as it is, and a late hello is only a packet") {
  Meeting m;
  const auto command = encode(kerf::OmniCommand{});
  m.client.say(command);
  m.client.say(encode(LinkHello{Personality::falcon, false, 8000}));
  CHECK(m.link.take(m.buffer).size() == command.size());
  CHECK(m.link.take(m.buffer).size() == kerf::kHelloBytes);
  CHECK(m.client.heard.empty());
  CHECK_FALSE(m.link.closed());
}

TEST_CASE("in lock-step a session after a hello has the bytes of one without") {
  std::vector<Bytes> heard[2];
  for (const bool greets : {false, true}) {
    kerf::Emulator emulator(kerf::OmniParams{}, std::nullopt);
    Meeting m;
    if (greets) m.client.say(encode(kOwn));
    for (int tick = 0; tick < 50; ++tick) m.client.say(encode(kerf::OmniCommand{}));
    const std::atomic<bool> stop{false};
    kerf::FrontStats stats;
    kerf::serve_lockstep(m.link, emulator, {.tick_cycles = 8}, {8 * 50, stop}, stats);
    CHECK(stats.cycles == 8 * 50);
    heard[greets ? 1 : 0] = m.client.heard;
  }
  const auto answer = std::find_if(heard[1].begin(), heard[1].end(), [](const Bytes& packet) {
    return kerf::decode_hello(packet).has_value();
  });
  REQUIRE(answer != heard[1].end());
  CHECK(std::vector<Bytes>(answer + 1, heard[1].end()) == heard[0]);
  CHECK(heard[0].size() == 51);
}

}  // namespace kerf::sockets_test
