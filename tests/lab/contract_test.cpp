// SPDX-License-Identifier: Apache-2.0
#include "lab/safety/contract.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include <doctest/doctest.h>

#include "hil/device/omni.hpp"
#include "lab/safety/device_wire.hpp"
#include "shared/wire/omni.hpp"
#include "tests/servo/support.hpp"

namespace kerf::contract_test {

using kerf::faults::DeviceMoment;
using kerf::faults::DeviceWire;
using kerf::faults::FaultOutcome;
using kerf::faults::SafetyMonitor;

namespace {

kerf::LoadedScene omni_scene() {
  kerf::LoadedScene scene = kerf::test::half_space_scene();
  scene.device.personality = kerf::Personality::omni;
  scene.limits.force_n = 3.3;
  scene.servo.rate_hz = 1000;
  return scene;
}

/// An Omni and its host as packets, in ticks of 1 ms: what a perfect servo and a broken one send.
struct Watched {
  kerf::LoadedScene scene = omni_scene();
  FaultOutcome outcome;
  SafetyMonitor contract{scene, true, outcome};
  DeviceWire wire{scene.device.personality, scene.device.dock_rad};
  double ms = 0;
  std::uint32_t packets = 0;
  OmniReport told{.encoder = {32760, -32700, 32700}};
  double n_per_count = 0;

  Watched() { n_per_count = norm(wire.force_n(*wire.pose(told.encoder), {0, 1, 0})); }

  void report() {
    told.counter = ++packets;
    contract.reported(ms, encode(told));
  }
  void command(double force_n, bool on = true) {
    OmniCommand asked{.motors_on = on};
    asked.motor[1] = static_cast<std::int16_t>(std::lround(force_n / n_per_count));
    contract.commanded(ms, encode(asked));
  }
  void tick(double force_n, bool on = true, bool hears = true) {
    ++ms;
    contract.listened(ms);
    if (hears) report();
    command(force_n, on);
    contract.cycle(ms, {{0, force_n, 0}, told.docked});
  }
  void park(int ticks) {
    told.docked = true;
    for (int i = 0; i < ticks; ++i) tick(0, false);
    told.docked = false;
  }
  /// Calibrates, fades in without a force, then goes up to `force_n` as fast as allowed.
  void push_up_to(double force_n) {
    park(60);
    for (int i = 0; i < 100; ++i) tick(0);
    for (double f = 0.5; f < force_n; f += 0.5) tick(f);
    tick(force_n);
  }
  /// The hand goes a little along a force of `command`.
  void leave() {
    const auto before = *wire.pose(told.encoder);
    const auto force_n = wire.force_n(before, {0, 100, 0});
    told.encoder[1] = static_cast<std::int16_t>(told.encoder[1] + 3);
    if (dot(force_n, wire.pose(told.encoder)->tip_mm - before.tip_mm) > 0) return;
    told.encoder[1] = static_cast<std::int16_t>(told.encoder[1] - 6);
  }
  /// Nothing is heard for so many ms; held, faded and off, as it should be.
  void lose(int ticks, double held_n) {
    for (int i = 1; i <= ticks; ++i) {
      const double share = std::clamp((20.0 - i) / 15.0, 0.0, 1.0);
      tick(held_n * share, i < 20, false);
    }
  }
};

}  // namespace

TEST_CASE("the contract accepts what it allows") {
  Watched run;
  run.push_up_to(3.3);
  run.lose(19, 3.3);
  run.tick(0.5);
  for (double f = 1; f < 3; f += 0.5) run.tick(f);
  run.leave();
  run.tick(0.1);  // lets go at once
  run.park(60);
  run.tick(0.03);
  CHECK(run.outcome.violation_count == 0);
  for (const std::string& line : run.outcome.violations) MESSAGE(line);
  CHECK(run.outcome.peak_n == doctest::Approx(3.3).epsilon(0.01));
  CHECK(run.outcome.steepest_n_per_ms == doctest::Approx(0.5).epsilon(0.02));
}

TEST_CASE("the contract sees each way to break it") {
  Watched run;
  SUBCASE("motors on before calibration") {
    run.tick(0);
  }
  SUBCASE("more than the peak") {
    run.push_up_to(3.3);
    run.tick(3.4);
  }
  SUBCASE("a rise of 0.6 N in a millisecond") {
    run.push_up_to(1);
    run.tick(1.6);
  }
  SUBCASE("a force that turns round in a tick, as long as before") {
    run.push_up_to(1);
    run.tick(-1);
  }
  SUBCASE("a fall of 0.6 N in a millisecond while the hand stays") {
    run.push_up_to(1);
    run.tick(0.4);
  }
  SUBCASE("a force let go 2 ms after the last report") {
    run.push_up_to(0.4);
    run.tick(0.4, true, false);
    run.tick(0.1, true, false);
  }
  SUBCASE("a force held for 20 ms without reports") {
    run.push_up_to(2);
    for (int i = 0; i < 19; ++i) run.tick(2, true, false);
  }
  SUBCASE("motors on 21 ms after the last report") {
    run.push_up_to(2);
    run.lose(19, 2);
    run.tick(0, true, false);
    run.tick(0, true, false);
  }
  SUBCASE("force again after a fault") {
    run.push_up_to(1);
    run.lose(30, 1);
    run.tick(0.1);
  }
  SUBCASE("one parked packet forgives a fault") {
    run.push_up_to(1);
    run.lose(30, 1);
    run.park(1);
    run.tick(0.03);
  }
  SUBCASE("a joint that turns while parked forgives a fault") {
    run.push_up_to(1);
    run.lose(30, 1);
    for (int i = 0; i < 60; ++i) {
      run.told.encoder[0] = static_cast<std::int16_t>(run.told.encoder[0] - 4);
      run.park(1);
    }
    run.tick(0.03);
  }
  SUBCASE("motors on while parked") {
    run.push_up_to(1);
    run.told.docked = true;
    run.tick(1);
  }
  SUBCASE("a force that came back without fading in") {
    run.push_up_to(1);
    run.park(1);
    for (int i = 0; i < 10; ++i) run.tick(0);
    run.tick(0.5);
  }
  SUBCASE("full force after a stall that the watchdog ended") {
    run.push_up_to(1);
    run.ms += 22;
    run.command(0, false);
    run.ms += 60;
    run.tick(0.5);
    run.tick(1);
  }
  SUBCASE("a stall that nobody ends") {
    run.push_up_to(1);
    for (int i = 0; i < 26; ++i) run.contract.cycle(++run.ms, {{0, 1, 0}, false});
  }
  SUBCASE("a tip at 20 m/s that is believed") {
    run.push_up_to(1);
    run.told.encoder[0] = static_cast<std::int16_t>(run.told.encoder[0] - 500);
    run.tick(1);
  }
  SUBCASE("the peak for five seconds") {
    run.push_up_to(3.3);
    for (int i = 0; i < 5000; ++i) run.tick(3.3);
  }
  SUBCASE("torque 3 ms after the motors went off") {
    run.push_up_to(1);
    run.tick(0, false);
    run.contract.cycle(run.ms + 3, {{0, 1, 0}, false});
  }
  SUBCASE("the device pushes more than it was told") {
    run.push_up_to(3.3);
    run.contract.cycle(run.ms, {{0, 3.6, 0}, false});
  }
  SUBCASE("a packet that the device cannot read") {
    run.contract.commanded(1, std::array<std::uint8_t, 3>{});
  }
  SUBCASE("a fault that should be latched, and is not") {
    run.push_up_to(1);
    run.contract.end(run.ms, "overspeed", run.ms);
  }
  SUBCASE("a fault that should not be latched") {
    run.push_up_to(1);
    run.lose(30, 1);
    run.contract.end(run.ms, "none", run.ms);
  }
  SUBCASE("another fault than the script says") {
    run.push_up_to(1);
    run.lose(30, 1);
    run.contract.end(run.ms, "overspeed", run.ms);
  }
  SUBCASE("a fall and a turn in one tick") {
    run.push_up_to(1.3);
    run.leave();
    run.tick(-0.45);
  }
  SUBCASE("motors that go off for good though nothing is wrong") {
    run.push_up_to(1);
    const double fault_ends_ms = run.ms;
    for (int i = 0; i < 50; ++i) run.tick(0, false);
    run.contract.end(run.ms, "none", fault_ends_ms);
  }
  CHECK(run.outcome.violation_count > 0);
  CHECK_FALSE(run.outcome.violations.empty());
}

TEST_CASE("a rest away from the dock leaves the motors off, until the device is docked") {
  Watched run;
  run.push_up_to(0);
  const auto dock = run.told.encoder;
  run.told.encoder[1] = static_cast<std::int16_t>(dock[1] - 1500);
  SUBCASE("a long rest") {
    run.park(60);
    CHECK(run.outcome.violation_count == 0);
    run.tick(0);
    CHECK(run.outcome.violation_count == 1);
    run.told.encoder = dock;
    run.park(60);
    run.tick(0);
    CHECK(run.outcome.violation_count == 1);
    CHECK(run.outcome.latched == "wrong_dock");
  }
  SUBCASE("a rest of 50 ms, one tick more or less: who knows") {
    run.park(50);
    run.tick(0);
    CHECK(run.outcome.violation_count == 0);
  }
  SUBCASE("a rest with a gap in the reports may have begun anew") {
    run.park(30);
    run.told.docked = true;
    for (int i = 0; i < 8; ++i) run.tick(0, false, false);
    run.park(25);
    run.tick(0);
    CHECK(run.outcome.violation_count == 0);
  }
}

TEST_CASE("reports that are too seldom for too long must leave the motors off") {
  Watched run;
  run.push_up_to(0.5);
  for (int gap = 0; gap < 4; ++gap) {
    CHECK(run.outcome.violation_count == 0);
    run.lose(18, 0.5);
    run.tick(0.5);
  }
  CHECK(run.outcome.violation_count > 0);
  CHECK(run.outcome.latched == "sparse_input");
}

TEST_CASE("the contract accepts the fault that the script says, in time") {
  Watched run;
  run.push_up_to(1);
  run.contract.fault_begins(1);  // nothing came of it
  run.contract.fault_begins(run.ms);
  run.lose(30, 1);
  run.contract.fault_begins(run.ms);  // too late to be the cause
  run.contract.end(run.ms, "stale_input", run.ms);
  for (const std::string& line : run.outcome.violations) MESSAGE(line);
  CHECK(run.outcome.violation_count == 0);
  CHECK(run.outcome.latched == "stale_input");
  CHECK(run.outcome.latch_ms == doctest::Approx(20));
}

TEST_CASE("a force into the solid is seen, whatever the motors' signs are") {
  // A Falcon above a half-space that fills y < 0: +y is the way out.
  const kerf::LoadedScene scene = kerf::test::half_space_scene();
  const kerf::faults::OutwardNormal outward(scene);
  const double radius_mm = scene.tools[scene.active_tool].radius_mm;
  const auto out = outward.at({0, radius_mm / 2, 0});
  REQUIRE(out);
  CHECK(out->y == doctest::Approx(1).epsilon(0.02));
  CHECK_FALSE(outward.at({0, 3 * radius_mm, 0}));
  CHECK_FALSE(outward.at({0, -2 * radius_mm, 0}));
  CHECK(outward.is_free({0, 3 * radius_mm, 0}));
  CHECK_FALSE(outward.is_free({0, radius_mm / 2, 0}));
}

TEST_CASE("after a signal to end the motors go off within 2 ms, and no later packet is another") {
  const auto ask = [](Watched& run) {
    run.push_up_to(2);
    run.contract.asked_to_end(run.ms);
  };
  Watched well;
  ask(well);
  well.tick(0, false);
  for (int i = 0; i < 50; ++i) well.tick(0, false);
  CHECK(well.outcome.violation_count == 0);

  Watched again;
  ask(again);
  again.tick(0, false);
  again.tick(0.2);
  REQUIRE(again.outcome.violation_count == 1);
  CHECK(again.outcome.violations[0].find("motors on after a signal to end") != std::string::npos);

  Watched silent;
  ask(silent);
  for (int i = 0; i < 3 * 8; ++i) {
    silent.ms += 0.125;
    silent.contract.cycle(silent.ms, {{0, 2, 0}, false});
  }
  REQUIRE(silent.outcome.violation_count > 0);
  CHECK(silent.outcome.violations[0].find("ms after a signal to end") != std::string::npos);
}

}  // namespace kerf::contract_test
