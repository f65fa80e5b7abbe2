// SPDX-License-Identifier: Apache-2.0
// The Omni's driver above its node: in order, through resets, loss and a stolen channel, and beside
// another Omni. In lock-step, so a tick is a millisecond whatever the machine does.
#include <atomic>
#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "tests/hil/fuse/bus_session.hpp"
#include "tests/support/errors.hpp"

namespace kerf::firewire_driver_test {

using kerf::test::Course;
using kerf::test::FirewireSession;
using kerf::test::kGoOn;

namespace {

/// Faults at these milliseconds.
FirewireSettings with(std::vector<ScriptedFault> script, bool reset_stops_stream) {
  constexpr std::int64_t kCyclesPerMs = 8;
  FirewireSettings settings;
  for (ScriptedFault& entry : script) entry.cycle *= kCyclesPerMs;
  settings.script = std::move(script);
  settings.reset_stops_stream = reset_stops_stream;
  return settings;
}

}  // namespace

TEST_CASE("the driver finds the device, reads every packet and commands each tick") {
  constexpr int kTicks = 1000;
  FirewireSession session;
  CHECK(session.port().device().serial == "50626300006");
  const Course course = session->run(kTicks);
  CHECK(course.fresh == kTicks);
  CHECK(course.allocations == 0);
  CHECK(session.driver().lost() == 0);
  CHECK(session.driver().refused() == 0);
  CHECK(session.port().misqueued() == 0);
  CHECK(session.port().stats().armings == 1);
  session.end();

  const auto& node = session.mounted().node();
  CHECK(node.bus().stats().commands >= kTicks);
  CHECK(node.bus().stats().undelivered == 0);
  CHECK(node.double_starts() == 0);
  CHECK(node.events_high_water() <= 4);  // it reads the events that it causes
  CHECK(session.mounted().emulator().stats().refused == 0);
  CHECK_FALSE(session.mounted().emulator().model().motors_on());
  CHECK_FALSE(node.bus().registers().streams());  // its enable bit is clear again
  CHECK(node.bus().registers().mode_20010() == 0);
}

TEST_CASE("the device's cycle of a packet moves by one servo period a tick, over its wrap") {
  FirewireSession session;
  static_cast<void>(session->tick());
  std::int32_t last = session.port().newest_cycle();
  for (int i = 0; i < 5000; ++i) {
    static_cast<void>(session->tick());
    const std::int32_t now = session.port().newest_cycle();
    CHECK(kerf::cycles_between(last, now) == 8);
    last = now;
  }
}

TEST_CASE("in lock-step a run above the servo is repeated bit by bit") {
  constexpr int kTicks = 4'000;
  std::vector<std::uint64_t> command_hashes, output_hashes;
  for (int run = 0; run < 2; ++run) {
    FirewireSession session;
    std::uint64_t output_hash = 0;
    int contact = 0;
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < kTicks; ++i) {
      const auto tick = session->tick();
      output_hash = tick.output.output_hash;
      contact += tick.output.contact ? 1 : 0;
    }
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    session.end();
    const double calls = static_cast<double>(session.mounted().mount().requests());
    MESSAGE((kTicks / took.count()), " ticks/s, ", (calls / kTicks), " calls a tick");
    CHECK(contact > 1000);
    command_hashes.push_back(session.mounted().node().bus().stats().command_hash);
    output_hashes.push_back(output_hash);
  }
  CHECK(command_hashes[0] == command_hashes[1]);
  CHECK(output_hashes[0] == output_hashes[1]);
}

TEST_CASE("a device of 1 kHz, a filled queue and the disputed register work, too") {
  for (const bool slow : {false, true}) {
    for (const bool fill : {false, true}) {
      CAPTURE(slow);
      CAPTURE(fill);
      FirewireSettings settings;
      settings.packet_cycles = slow ? 8 : 1;
      settings.abi_version = slow ? 6 : 5;  // a newer kernel, too
      FirewireOptions options;
      options.write_20010 = true;
      options.fill = fill;
      FirewireSession session(settings, options);
      CHECK(session->run(3000).fresh >= 2999);
      CHECK(session.driver().lost() == 0);
      session.end();
      const auto& stats = session.mounted().node().bus().stats();
      // What is still queued at the end is at most a servo period and its margin.
      CHECK(stats.commands >= 2998);
      CHECK(session.mounted().node().bus().registers().mode_20010() == 0x0FF8);
      CHECK(session.mounted().node().events_high_water() <= 4);
    }
  }
}

TEST_CASE("resets: a device that streams on loses nothing, one that stops is armed again") {
  const std::vector<ScriptedFault> streaming{
      {300, BusFault::reset}, {700, BusFault::reset}, {1200, BusFault::device_reset}};
  std::vector<ScriptedFault> ten;
  for (int i = 0; i < 10; ++i) ten.push_back({500 + 3 * i, BusFault::reset});
  struct {
    std::string name;
    std::vector<ScriptedFault> script;
    bool stops_stream;
    int longest_gap_ms;
    std::uint64_t resets;  ///< that the port has seen; 0: not checked
  } const cases[] = {
      {"streams on", streaming, false, 0, 3},
      {"stops", {{300, BusFault::reset}, {700, BusFault::reset}}, true, 5, 2},
      // Its event comes half a second later; from 20 ms on the servo latches a fault.
      {"resets by itself", {{300, BusFault::device_reset}}, true, 19, 0},
      {"ten in a row", ten, true, 99, 0},
  };
  for (const auto& [name, script, stops_stream, longest_gap_ms, resets] : cases) {
    CAPTURE(name);
    FirewireSession session(with(script, stops_stream));
    const Course course = session->run(2000);
    CHECK(course.longest_gap <= longest_gap_ms);
    CHECK(course.gap_at_end == 0);
    if (longest_gap_ms == 0) CHECK(session.driver().lost() == 0);
    if (resets > 0) CHECK(session.port().stats().resets == resets);
    CHECK(course.allocations == 0);
  }
}

TEST_CASE("a stolen channel means motors off, and a new channel after the bus's second of grace") {
  for (const bool stops : {false, true}) {
    FirewireSession session(with({{2500, BusFault::steal}}, stops));
    const Course course = session->run(6000);
    CHECK(course.longest_gap < 1500);
    CHECK(course.stale_with_motors == 0);
    CHECK(course.gap_at_end == 0);
    CHECK(session.port().stats().reclaims == 1);
    CHECK_FALSE(session.port().closed());
    session.end();
    CHECK(session.mounted().emulator().stats().refused == 0);
  }
}

TEST_CASE("a stolen channel carries nothing but neutral packets, whatever is commanded") {
  struct : kerf::PacketDevice {
    void receive(std::span<const std::uint8_t> packet) noexcept override {
      motors_on = kerf::decode_command(packet)->motors_on;
    }
    void advance(int /*cycles*/) noexcept override { due = true; }
    std::span<const std::uint8_t> next_packet() noexcept override {
      if (!std::exchange(due, false)) return {};
      bytes = kerf::encode(kerf::OmniReport{.counter = ++counter});
      return bytes;
    }
    std::atomic<bool> motors_on{false};
    bool due = false;
    std::uint32_t counter = 0;
    kerf::omni::ReportBytes bytes{};
  } device;
  const kerf::test::MountedDevice mounted(with({{200, BusFault::steal}}, false), device);
  FirewireOptions options;
  options.where = mounted.path();
  kerf::FirewirePort port(options, 0, kGoOn);
  kerf::OmniDriver driver(port);
  kerf::ServoOutput output;
  output.motors_on = true;
  int on_before = 0, on_after = 0, on_again = 0;
  for (int tick = 0; tick < 2000; ++tick) {
    static_cast<void>(driver.read());
    driver.command(output);
    const int on = device.motors_on ? 1 : 0;
    if (tick > 10 && tick < 190) on_before += on;
    if (tick > 203 && tick < 1000) on_after += on;
    if (tick > 1900) on_again += on;
  }
  CHECK(on_before == 179);
  CHECK(on_after == 0);
  CHECK(on_again == 99);
}

TEST_CASE("a device that vanishes is stale at once and closed after two seconds") {
  FirewireSession session(with({{1000, BusFault::vanish}}, true));
  const Course course = session->run(1500);
  CHECK(course.longest_gap > 400);
  CHECK(course.stale_with_motors == 0);
  CHECK_FALSE(session.port().closed());  // the kernel reports nothing yet
  static_cast<void>(session->run(3000));
  CHECK(session.port().closed());
  CHECK_FALSE(session.driver().read().fresh);
  CHECK_FALSE(session.driver().release());
}

TEST_CASE("a device that is back within two seconds streams again on the same opens") {
  FirewireSession session(with({{1000, BusFault::vanish}, {1700, BusFault::back}}, true));
  const Course course = session->run(2500);
  CHECK(course.longest_gap >= 700);
  CHECK(course.longest_gap < 720);
  CHECK(course.stale_with_motors == 0);
  CHECK(course.gap_at_end == 0);
  CHECK(course.allocations == 0);
}

namespace {

constexpr std::uint32_t kOther = 0x83A6'D80E;

FirewireSettings settings_of(std::uint32_t packed, std::vector<ScriptedFault> script = {}) {
  FirewireSettings settings = with(std::move(script), false);
  settings.packed_serial = packed;
  return settings;
}

/// `fw0` and `fw1` in one folder, served by one thread.
struct TwoArms {
  TwoArms() : mount(folder.path()) {
    mount.add("fw0", left);
    mount.add("fw1", right);
    thread = std::thread([this] { mount.serve([this] { return !stop; }); });
  }
  ~TwoArms() {
    stop = true;
    thread.join();
  }
  kerf::test::TemporaryFolder folder;
  kerf::Emulator left_arm{kerf::OmniParams{}, {}}, right_arm{kerf::OmniParams{}, {}};
  kerf::FirewireNode left{settings_of(0x82B6'980C), left_arm};
  kerf::FirewireNode right{settings_of(kOther, {{300, BusFault::vanish}}), right_arm};
  kerf::FuseMount mount;
  std::atomic<bool> stop{false};
  std::thread thread;
};

}  // namespace

TEST_CASE("of two devices one is named by its node or its serial, and none is guessed") {
  const TwoArms arms;
  int refused = 0;
  const auto all = kerf::list_firewire(arms.folder.path(), &refused);
  REQUIRE(all.size() == 2);
  CHECK(refused == 0);
  CHECK(all[0].serial == "50626300006");
  CHECK(all[1].serial == "70427300007");

  const auto find = [&](const std::string& where) {
    FirewireOptions options;
    options.where = where;
    return kerf::find_firewire(options, arms.folder.path());
  };
  CHECK(find(arms.folder / "fw1").packed == kOther);
  CHECK(find("50626300006").path == (arms.folder / "fw0").string());
  const auto error = [&](const std::string& where) {
    return kerf::test::error_of([&] { static_cast<void>(find(where)); });
  };
  CHECK(kerf::test::has(error(arms.folder.path()), "several devices are there: "));
  CHECK(kerf::test::has(error("50626300007"), "no device of SensAble with this serial number"));
}

TEST_CASE("one of two devices dies, the other one runs on") {
  const TwoArms arms;
  FirewireOptions options;
  options.where = arms.folder / "fw0";
  kerf::FirewirePort left_port(options, 0, kGoOn);
  options.where = arms.folder / "fw1";
  kerf::FirewirePort right_port(options, 0, kGoOn);
  kerf::OmniDriver left(left_port), right(right_port);
  int left_fresh = 0, right_fresh = 0;
  constexpr int kTicks = 3000;
  for (int i = 0; i < kTicks; ++i) {
    left_fresh += left.read().fresh ? 1 : 0;
    right_fresh += right.read().fresh ? 1 : 0;
    left.command({});
    right.command({});
  }
  CHECK(left_fresh == kTicks);
  CHECK(left.lost() == 0);
  CHECK_FALSE(left_port.closed());
  CHECK(right_fresh < 310);
  CHECK(right_port.closed());
}

}  // namespace kerf::firewire_driver_test
