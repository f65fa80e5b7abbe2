// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

#include "hil/device/emulator.hpp"
#include "hil/front/serving.hpp"
#include "hil/front/socket_servers.hpp"
#include "hil/hil_error.hpp"
#include "hil/script/hand_script_file.hpp"
#include "tests/hil/fake_host.hpp"

namespace {

using kerf::Emulator;
using kerf::FrontStats;
using kerf::OmniCommand;
using kerf::OmniReport;
using kerf::SeqpacketServer;
using kerf::test::FakeHost;
using kerf::test::SocketPath;

/// One emulator that serves one client in its own thread.
class Served {
 public:
  template <class Serve>
  Served(const std::string& path, Serve&& serve)
      : server_(path), thread_([this, serve] {
          auto client = server_.accept(stop_);
          if (client) serve(*client, emulator_, kerf::ServeLimits{0, stop_}, stats_);
        }) {}
  ~Served() {
    stop_ = true;
    join();
  }
  void join() {
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] const FrontStats& stats() const { return stats_; }
  [[nodiscard]] const Emulator& emulator() const { return emulator_; }

 private:
  Emulator emulator_{{}, kerf::read_hand_script(KERF_HANDS "/touch.toml")};
  FrontStats stats_;
  std::atomic<bool> stop_{false};
  SeqpacketServer server_;
  std::thread thread_;
};

const auto kLockstep = [](auto& client, auto& device, const auto& limits, auto& stats) {
  kerf::serve_lockstep(client, device, {.tick_cycles = 8}, limits, stats);
};
const auto kRealTime = [](auto& client, auto& device, const auto& limits, auto& stats) {
  kerf::serve_real_time(client, device, 4, limits, stats);
};

std::vector<OmniReport> lockstep_session(const std::string& path, int ticks) {
  Served served(path, kLockstep);
  FakeHost host(path);
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
  const SocketPath path("lockstep");
  const auto first = lockstep_session(path.text(), 2000);
  REQUIRE(first.size() == 2000);
  for (std::size_t i = 0; i < first.size(); ++i) CHECK(first[i].counter == i + 1);
  CHECK(first.front().docked);
  CHECK_FALSE(first.back().docked);  // the hand left meanwhile
  CHECK(lockstep_session(path.text(), 2000) == first);
}

TEST_CASE("in lock-step nothing moves without a command") {
  const SocketPath path("waits");
  Served served(path.text(), kLockstep);
  FakeHost host(path.text());
  CHECK(host.receive().has_value());
  CHECK_FALSE(host.receive(250).has_value());
  CHECK_FALSE(host.ended());
  host.send({});
  CHECK(host.receive().has_value());
}

TEST_CASE("in real time packets come by themselves and commands are applied") {
  const SocketPath path("realtime");
  Served served(path.text(), kRealTime);
  FakeHost host(path.text());
  host.send({{100, 100, 100}, true, OmniCommand::Light::steady});
  const auto begin = std::chrono::steady_clock::now();
  std::uint32_t last = 0;
  for (int i = 0; i < 400; ++i) {
    const auto report = host.receive();
    REQUIRE(report);
    CHECK(report->counter == last + 1);
    last = report->counter;
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  CHECK(took.count() > 0.19);  // 400 packets at 2 kHz cannot come sooner
  host.leave();
  served.join();
  CHECK(served.emulator().stats().commands == 1);
  CHECK(served.emulator().stats().peak_motor_force_n > 0);
  CHECK(served.stats().wake.count() >= 400);
}

TEST_CASE("a client that does not read loses packets and stops nobody") {
  const SocketPath path("slow");
  Served served(path.text(), kRealTime);
  FakeHost host(path.text());
  std::this_thread::sleep_for(std::chrono::milliseconds(1000));
  std::uint32_t waiting = 0;
  for (;; ++waiting) {
    if (!host.receive(0)) break;
  }
  const auto fresh = host.receive();
  REQUIRE(fresh);
  CHECK(fresh->counter > waiting + 1);  // there is a gap
  host.leave();
  served.join();
  CHECK(served.stats().dropped > 0);
  CHECK(served.stats().cycles >= 2000);
}

TEST_CASE("a server takes over a stale socket, refuses a live one, and removes its own") {
  const SocketPath path("stale");
  {
    // A listener that died without cleaning up: the file stays, nobody listens.
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.text().c_str(), sizeof address.sun_path - 1);
    const int dead = socket(AF_UNIX, SOCK_SEQPACKET, 0);
    REQUIRE(bind(dead, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
    close(dead);
  }
  REQUIRE(std::filesystem::exists(path.text()));
  {
    SeqpacketServer server(path.text());
    CHECK_THROWS_WITH_AS(SeqpacketServer second(path.text()),
                         ("--socket: " + path.text() +
                          " is in use by another emulator; end it or choose another path")
                             .c_str(),
                         kerf::HilError);
    // The question has not disturbed the first one: it still serves.
    const FakeHost host(path.text());
    CHECK(host.connected());
    const std::atomic<bool> stop{false};
    CHECK(server.accept(stop).has_value());
  }
  CHECK_FALSE(std::filesystem::exists(path.text()));
}

TEST_CASE("a path that is no socket, too long or in no folder is refused") {
  const SocketPath path("file");
  std::ofstream(path.text()) << "precious";
  CHECK_THROWS_AS(SeqpacketServer{path.text()}, kerf::HilError);
  CHECK(std::filesystem::file_size(path.text()) == 8);
  // Nor is one lost that has the name which the socket bears until it listens.
  const SocketPath born("born");
  std::ofstream(born.text() + ".new") << "precious";
  CHECK_THROWS_AS(SeqpacketServer{born.text()}, kerf::HilError);
  CHECK(std::filesystem::file_size(born.text() + ".new") == 8);
  std::filesystem::remove(born.text() + ".new");
  CHECK_NOTHROW(SeqpacketServer{born.text()});
  CHECK_THROWS_AS(SeqpacketServer{std::string(104, 'x')}, kerf::HilError);
  CHECK_THROWS_AS(SeqpacketServer{""}, kerf::HilError);
  CHECK_THROWS_AS(SeqpacketServer{"/nowhere/at/all"}, kerf::HilError);
}

TEST_CASE("waiting for a client ends with a stop request") {
  const SocketPath path("stop");
  SeqpacketServer server(path.text());
  std::atomic<bool> stop{false};
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    stop = true;
  });
  CHECK_FALSE(server.accept(stop).has_value());
  later.join();
}

TEST_CASE("a thread that gets no real-time right is told what it misses, without stopping") {
  std::string none;
  std::string absent_core;
  std::thread([&] {
    none = kerf::make_real_time(0, 1000);
    absent_core = kerf::make_real_time(1, 1000);
  }).join();
  CHECK(none == "");
  CHECK(absent_core.find("no right to core 1000") == 0);
}
