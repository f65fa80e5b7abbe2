// SPDX-License-Identifier: Apache-2.0
// What the driver makes of a bus that is reset, loses its channels or its device; in lock-step, so
// a tick is a millisecond whatever the machine does.
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/loop/allocation_counter.hpp"
#include "tests/hil/fuse/lockstep_session.hpp"

using kerf::BusFault;
using kerf::FirewireSettings;
using kerf::ScriptedFault;
using kerf::test::FirewireSession;

namespace {

constexpr std::int64_t kCyclesPerMs = 8;

/// Faults at these milliseconds.
FirewireSettings with(std::vector<ScriptedFault> script, bool reset_stops_stream) {
  FirewireSettings settings;
  for (ScriptedFault& entry : script) entry.cycle *= kCyclesPerMs;
  settings.script = std::move(script);
  settings.reset_stops_stream = reset_stops_stream;
  return settings;
}

struct Course {
  int longest_gap_ms = 0;     ///< without a report
  int stale_with_motors = 0;  ///< ticks beyond 20 ms without a report and motors still asked for
  bool fresh_at_end = false;
  bool closed = false;
  std::uint64_t allocations = 0;
};

Course run(FirewireSession& session, int ticks) {
  Course course;
  int gap = 0;
  for (int i = 0; i < ticks; ++i) {
    kerf::DeviceReport report;
    {
      const std::uint64_t before = kerf::CountedAllocations::total();
      const kerf::CountedAllocations counted;
      report = session.driver().read();
      course.allocations += kerf::CountedAllocations::total() - before;
    }
    const kerf::ServoOutput output = session.step(report);
    gap = report.fresh ? 0 : gap + 1;
    course.longest_gap_ms = std::max(course.longest_gap_ms, gap);
    if (gap > 20 && output.motors_on) ++course.stale_with_motors;
    course.fresh_at_end = report.fresh;
  }
  course.closed = session.port().closed();
  return course;
}

}  // namespace

TEST_CASE("a device that streams through bus resets loses no packet") {
  FirewireSession session(with(
      {{300, BusFault::reset}, {700, BusFault::reset}, {1200, BusFault::device_reset}}, false));
  const Course course = run(session, 3000);
  CHECK(course.longest_gap_ms == 0);
  CHECK(session.driver().lost() == 0);
  CHECK(session.port().stats().resets == 3);
  CHECK(course.allocations == 0);
}

TEST_CASE("a device that forgets its channels in a bus reset is armed again at once") {
  FirewireSession session(with({{300, BusFault::reset}, {700, BusFault::reset}}, true));
  const Course course = run(session, 2000);
  MESSAGE("longest gap ", course.longest_gap_ms, " ms");
  CHECK(course.longest_gap_ms <= 5);
  CHECK(course.fresh_at_end);
  CHECK(session.port().stats().resets == 2);
  CHECK(course.allocations == 0);
}

TEST_CASE("a reset by the device itself, told half a second later, is no fault of the servo") {
  FirewireSession session(with({{300, BusFault::device_reset}}, true));
  const Course course = run(session, 2000);
  MESSAGE("longest gap ", course.longest_gap_ms, " ms");
  CHECK(course.longest_gap_ms < 20);  // from there on the servo latches one
  CHECK(course.stale_with_motors == 0);
  CHECK(course.fresh_at_end);
}

TEST_CASE("ten resets in a row end in a stream") {
  std::vector<ScriptedFault> script;
  for (int i = 0; i < 10; ++i) script.push_back({500 + 3 * i, BusFault::reset});
  FirewireSession session(with(script, true));
  const Course course = run(session, 1500);
  CHECK(course.longest_gap_ms < 100);
  CHECK(course.fresh_at_end);
}

TEST_CASE("a stolen channel means motors off, and a new channel after the bus's second of grace") {
  for (const bool stops : {false, true}) {
    FirewireSession session(with({{2500, BusFault::steal}}, stops));
    const Course course = run(session, 6000);
    MESSAGE("longest gap ", course.longest_gap_ms, " ms");
    CHECK(course.longest_gap_ms < 1500);
    CHECK(course.stale_with_motors == 0);
    CHECK(course.fresh_at_end);
    CHECK(session.port().stats().reclaims == 1);
    CHECK_FALSE(course.closed);
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
  const std::atomic<bool> go_on{false};
  kerf::FirewireOptions options;
  options.where = mounted.path();
  kerf::FirewirePort port(options, 0, go_on);
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
  Course course = run(session, 1500);
  CHECK(course.longest_gap_ms > 400);
  CHECK(course.stale_with_motors == 0);
  CHECK_FALSE(course.closed);  // the kernel says nothing yet
  course = run(session, 3000);
  CHECK(course.closed);
  CHECK_FALSE(session.driver().read().fresh);
  CHECK_FALSE(session.driver().release());
}

TEST_CASE("a device that is back within two seconds streams again on the same opens") {
  FirewireSession session(with({{1000, BusFault::vanish}, {1700, BusFault::back}}, true));
  const Course course = run(session, 2500);
  CHECK(course.longest_gap_ms >= 700);
  CHECK(course.longest_gap_ms < 720);
  CHECK(course.stale_with_motors == 0);
  CHECK(course.fresh_at_end);
  CHECK(course.allocations == 0);
}
