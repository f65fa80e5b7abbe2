// SPDX-License-Identifier: Apache-2.0
// What the step does when something is wrong, and which limits no scene gets past.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <memory>

#include <doctest/doctest.h>

#include "controller/plan/plan_device.hpp"
#include "controller/servo/sense.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "tests/servo/support.hpp"

namespace kerf::servo_safety_test {

using namespace kerf::test;

TEST_CASE("reports stop: the force holds 5 ms, is zero at 20 ms, motors off, fault latched") {
  LoadedScene scene = half_space_scene();
  ArmedServo armed(scene);
  const double held_n = length(armed.settled(0, 0.3, 0).commanded_force_n);
  REQUIRE(held_n > 0.1);
  for (int ms = 1; ms <= 25; ++ms) {
    const ServoOutput out = armed.servo->step({});
    CAPTURE(ms);
    if (ms <= 5) CHECK(length(out.commanded_force_n) == doctest::Approx(held_n).epsilon(1e-3));
    if (ms > 5) CHECK(length(out.commanded_force_n) < held_n);
    if (ms >= 20) {
      CHECK(length(out.commanded_force_n) == 0);
      CHECK_FALSE(out.motors_on);
      CHECK(out.fault == Fault::stale_input);
      CHECK(out.dac_counts == std::array<std::int16_t, 3>{});
    }
  }
  CHECK(armed.settled(0, 0.3, 0).phase == Phase::fault);  // stays off
  arm_at(*armed.servo, armed.arm, 0, 5, 0);               // until docked again
  CHECK(length(armed.settled(0, 0.3, 0).commanded_force_n) > 0.1);
}

TEST_CASE("one packet with the docked bit neither moves the tip nor forgives a fault") {
  LoadedScene scene = half_space_scene();
  ArmedServo armed(scene);
  const ServoOutput before = armed.settled(0, 0.3, 0);
  auto glitch = armed.arm.at(0, 0.3, 0);
  glitch.parked = true;
  CHECK_FALSE(armed.servo->step(glitch).motors_on);
  const ServoOutput after = armed.step(0, 0.3, 0);
  CHECK(after.position_mm == before.position_mm);
  CHECK(length(after.commanded_force_n) <
        0.1 * length(before.commanded_force_n));  // fades in again
  for (int ms = 0; ms < 30; ++ms) static_cast<void>(armed.servo->step({}));
  glitch = armed.arm.at(0, 0.3, 0);
  glitch.parked = true;
  CHECK(armed.servo->step(glitch).fault == Fault::stale_input);
  CHECK_FALSE(armed.step(0, 0.3, 0).motors_on);
}

TEST_CASE("a stylus that moves while the docked bit is set is not calibrated") {
  LoadedScene scene = half_space_scene();
  const auto servo = compile(scene);
  KinematicOmni arm;
  for (int tick = 0; tick < 100; ++tick) {
    auto report = arm.at(0, -30 + tick * 0.5, 0);
    report.parked = true;
    CHECK(servo->step(report).phase == Phase::calibrating);
  }
}

TEST_CASE("after a stall the force starts again from nothing") {
  LoadedScene scene = half_space_scene();
  scene.force.stiffness_n_per_mm = 50;
  ArmedServo armed(scene);
  REQUIRE(length(armed.settled(0, 0.3, 0).commanded_force_n) > 3);
  armed.servo->apply({.kind = ServoCommand::Kind::fade_in});
  double last_n = 0;
  for (int tick = 0; tick < 20; ++tick) {
    const double force_n = length(armed.step(0, 0.3, 0).commanded_force_n);
    CHECK(force_n <= last_n + 0.5 + 1e-4);
    CHECK(force_n <= 3.3 * (tick + 1) / 100 + 1e-4);  // however much the contact wants
    last_n = force_n;
  }
  CHECK(last_n > 0.5);
}

namespace {

/// Steps a servo that presses with more than the peak, which alone is three times the budget of
/// heat, by `step(armed, tick)`: the heat stays within the budget, and uses it.
template <class Step>
void check_heat(const Step& step) {
  LoadedScene scene = half_space_scene();
  scene.force.stiffness_n_per_mm = 50;
  ArmedServo armed(scene);
  double heat_n2 = 0;
  for (int tick = 0; tick < 8000; ++tick) {
    const double force_n = length(step(armed, tick).commanded_force_n);
    heat_n2 += (force_n * force_n - heat_n2) / 10'000;
    CHECK(std::sqrt(heat_n2) <= scene.limits.continuous_force_n + 0.01);
  }
  CHECK(std::sqrt(heat_n2) > 0.9 * scene.limits.continuous_force_n);
}

}  // namespace

TEST_CASE("a device that is parked again and again while it presses bears the heat of every ramp") {
  check_heat([](ArmedServo& armed, int tick) {
    auto report = armed.arm.at(0, 0.3, 0);
    report.parked =
        tick % 130 < 20;  // too short to calibrate, and little more than the ramp between
    return armed.servo->step(report);
  });
}

TEST_CASE("a force that is held without reports heats the motors like any other") {
  check_heat([](ArmedServo& armed, int tick) {
    const bool lost = tick % 5 != 0;  // as long as a force is held in full
    return lost ? armed.servo->step({}) : armed.step(0, 0.3, 0);
  });
}

TEST_CASE("whatever noise the encoders have, the force changes by the slew or by what there was") {
  for (const int rate_hz : {250, 1000, 8000}) {
    CAPTURE(rate_hz);
    LoadedScene scene = half_space_scene();
    scene.servo.rate_hz = rate_hz;
    scene.force.stiffness_n_per_mm = 1;
    ArmedServo armed(scene, {0, 1.1, 0}, std::max(1, rate_hz / 1000));
    constexpr double kDeepMm = -2;  // 3 mm into the solid
    std::array<double, 3> last{};
    for (int i = 1; i <= 200; ++i)
      last = armed.step(0, 1 + (kDeepMm - 1) * i / 200, 0).commanded_force_n;
    REQUIRE(length(last) > 1);
    std::uint32_t random = 1;
    const int most = rate_hz > 1000 ? 2 : 5;  // counts; more is faster than 10 m/s
    double steepest_n = 0;
    for (int tick = 0; tick < 2000; ++tick) {
      auto report = armed.arm.at(0, kDeepMm, 0);
      for (auto& count : report.counts) {
        random = random * 1664525 + 1013904223;
        count = static_cast<std::int16_t>(count + static_cast<int>(random >> 16) % (2 * most + 1) -
                                          most);
      }
      const ServoOutput out = armed.servo->step(report);
      REQUIRE(out.fault == Fault::none);
      const double change_n = length(vec3::operator-(out.commanded_force_n, last));
      CHECK(change_n <= std::max(500.0 / rate_hz, length(last)) + 1e-4);
      steepest_n = std::max(steepest_n, change_n);
      last = out.commanded_force_n;
    }
    if (rate_hz >= 1000) CHECK(steepest_n > 500.0 / rate_hz);  // it fell at once, too
  }
}

TEST_CASE("a packet each 19 ms, for ever: a latched fault within 0.1 s, at any rate") {
  for (const int rate_hz : {250, 1000, 8000}) {
    CAPTURE(rate_hz);
    LoadedScene scene = half_space_scene();
    scene.servo.rate_hz = rate_hz;
    ArmedServo armed(scene, {0, 1.1, 0}, std::max(1, rate_hz / 1000));
    REQUIRE(length(armed.settled(0, 0.3, 0).commanded_force_n) > 0.1);
    const int period = 19 * rate_hz / 1000;
    ServoOutput out;
    for (int tick = 1; tick <= rate_hz / 10; ++tick) {
      out = tick % period == 0 ? armed.step(0, 0.3, 0) : armed.servo->step({});
    }
    CHECK(out.fault == Fault::sparse_input);
    CHECK_FALSE(out.motors_on);
  }
}

TEST_CASE("a force beyond the motors keeps its direction, and what was sent is what is told") {
  LoadedScene scene = half_space_scene();
  scene.force.stiffness_n_per_mm = 50;
  scene.device.torque_scale = std::array{0.01, 0.01, 0.01};  // the range ends at 20 N mm
  ArmedServo armed(scene);
  const ServoOutput out = armed.settled(0.2, 0.3, 0.2);
  CHECK(out.clamped);
  CHECK(length(out.commanded_force_n) < 1);
  int largest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    largest = std::max(largest, std::abs(int{out.dac_counts[i]}));
    CHECK(out.dac_counts[i] * 0.01 == doctest::Approx(out.torque_n_mm[i]).epsilon(0.01));
  }
  CHECK(largest == 2047);
}

TEST_CASE("a force that is not finite ends the motors at once") {
  LoadedScene scene = paper_scene();
  scene.servo.numeric = NumericKind::float64;
  scene.force.p0_n_per_mm2 = std::numeric_limits<double>::quiet_NaN();
  ArmedServo armed(scene);
  const ServoOutput out = armed.settled(0, 0.3, 0);
  CHECK(out.fault == Fault::not_finite);
  CHECK_FALSE(out.motors_on);
  CHECK(out.dac_counts == std::array<std::int16_t, 3>{});
}

TEST_CASE("a pose that is not finite: motors off after 2 ms, until the device was parked") {
  // No counts of a real arm give NaN in double. A step of infinite size does at count zero, and
  // ends at the joint's limit at any other.
  using N = DoubleNumbers;
  LoadedScene scene = half_space_scene();
  scene.device.personality = Personality::woodenhaptics;
  scene.servo.numeric = NumericKind::float64;
  for (const int rate_hz : {250, 1000, 8000}) {
    CAPTURE(rate_hz);
    scene.servo.rate_hz = rate_hz;
    ServoPlan<N> plan;
    plan_device(scene.device, plan);
    plan_limits(scene, plan);
    plan_laws(scene, plan);
    plan.device.joints[0].angle_per_count = std::numeric_limits<double>::infinity();
    const auto state = std::make_unique<ServoState<N>>();
    DeviceReport report{.fresh = true, .parked = true, .homed = true};
    report.counts = {1, 1, 1};
    const auto motors_on = [&] {
      static_cast<void>(sense(plan, *state, report));
      return state->supervisor.motors_on();
    };
    for (int tick = 0; tick <= rate_hz / 10; ++tick) motors_on();
    report.parked = false;
    for (int tick = 0; tick <= rate_hz / 10; ++tick) REQUIRE(motors_on());
    report.counts[0] = 0;
    int ticks_on = 0;
    while (motors_on() && ticks_on < rate_hz) ++ticks_on;
    CHECK(ticks_on == 2 * rate_hz / 1000);
    report.counts[0] = 1;
    CHECK_FALSE(motors_on());
    CHECK(state->supervisor.fault == Fault::not_finite);
  }
}

TEST_CASE("faster than 10 m/s: motors off in the same tick") {
  LoadedScene scene = half_space_scene();
  ArmedServo armed(scene);
  REQUIRE(armed.settled(0, 0.3, 0).motors_on);
  const ServoOutput out = armed.step(0, 15.0, 0);
  CHECK(out.fault == Fault::overspeed);
  CHECK_FALSE(out.motors_on);
  CHECK(length(out.commanded_force_n) == 0);
}

TEST_CASE("counters far beyond any joint leave a place in range, and docking forgets the jump") {
  for (const NumericKind numeric : {NumericKind::fixed, NumericKind::float64}) {
    CAPTURE(static_cast<int>(numeric));
    LoadedScene scene = half_space_scene();
    scene.servo.numeric = numeric;
    scene.servo.velocity = {LawKind::velocity, "difference", {{"tau_ms", 1000}}};
    ArmedServo armed(scene);
    auto report = armed.arm.at(0, 5, 0);
    for (int i = 0; i < 100; ++i) {  // to a million counts, where the sines' series leaves floats
      for (auto& encoder : report.counts) encoder = static_cast<std::int16_t>(encoder + 10'000);
      const ServoOutput out = armed.servo->step(report);
      CHECK(length(out.position_mm) < 10'000);
      CHECK_FALSE(out.motors_on);
    }
    arm_at(*armed.servo, armed.arm, 0, 5, 0);
    const ServoOutput out = armed.step(0, 5, 0);
    CHECK(out.motors_on);
    CHECK(length(out.velocity_mm_per_s) < 1000);  // of the way from the dock alone
  }
}

TEST_CASE("a scene without torque scale feels, but never turns the motors on") {
  LoadedScene scene = half_space_scene();
  scene.device.torque_scale.reset();
  ArmedServo armed(scene);
  const ServoOutput out = armed.settled(0, 0.3, 0);
  CHECK(length(out.contact_force_n) > 0.1);
  CHECK_FALSE(out.motors_on);
  CHECK(length(out.commanded_force_n) == 0);
}

TEST_CASE("a very stiff scene meets every limit and keeps the force below 3.3 N") {
  LoadedScene scene = half_space_scene();
  scene.force.stiffness_n_per_mm = 50;
  ArmedServo armed(scene);
  std::array<double, 3> last{};
  for (int tick = 0; tick < 200; ++tick) {
    const ServoOutput out = armed.step(0, tick < 100 ? 0.0 : 5.0, 0);
    CHECK(length(out.commanded_force_n) <= 3.3);
    // In the tick in which the hand leaves the force may fall along its own direction at once.
    const double square = vec3::dot(last, last);
    const double kept = tick == 100 && square > 0
                            ? std::clamp(vec3::dot(out.commanded_force_n, last) / square, 0.0, 1.0)
                            : 1;
    CHECK(length(vec3::operator-(out.commanded_force_n, vec3::operator*(kept, last))) <=
          0.5 + 1e-4);
    for (const auto counts : out.dac_counts) CHECK(std::abs(counts) <= 2047);
    last = out.commanded_force_n;
  }
}

TEST_CASE("whatever counters and pots read, the tool keeps its size and the force its limit") {
  for (const NumericKind numeric : {NumericKind::fixed, NumericKind::float64}) {
    for (const double scale : {1.0, 100.0}) {  // of a hundred: a count moves the tool by voxels
      CAPTURE(static_cast<int>(numeric));
      CAPTURE(scale);
      LoadedScene scene = half_space_scene();
      scene.tools = {
          make_tool("thin", "cylinder", {.pitch_mm = 0.125, .radius_mm = 0.1, .length_mm = 0.4})};
      scene.servo.numeric = numeric;
      scene.device.workspace_scale = scale;
      ArmedServo armed(scene);
      static_cast<void>(armed.settled(0, 0.05, 0));
      DeviceReport report = armed.arm.at(0, 0.05, 0);
      std::uint32_t state = 1;
      const auto next = [&state] {
        state = state * 1664525 + 1013904223;
        return static_cast<int>(state >> 16);
      };
      for (int tick = 0; tick < 6000; ++tick) {
        // Some near the wall, some anywhere that 16 bits reach.
        if (tick % 8 == 0) report = armed.arm.at(0, 0.05, 0);
        const auto joint = static_cast<std::size_t>(next() % 3);
        report.counts[joint] = static_cast<std::int16_t>(
            report.counts[joint] + (tick % 8 < 4 ? next() % 64 - 32 : next()));
        report.wiper_a[joint] = static_cast<std::uint16_t>(next());
        report.wiper_b[joint] = static_cast<std::uint16_t>(next());
        const ServoOutput out = armed.servo->step(report);
        double worst = 0;
        for (std::size_t i = 0; i < 9; ++i) {
          const std::size_t a = 3 * (i / 3), b = 3 * (i % 3);
          const double product = out.rotation[a] * out.rotation[b] +
                                 out.rotation[a + 1] * out.rotation[b + 1] +
                                 out.rotation[a + 2] * out.rotation[b + 2];
          worst = std::max(worst, std::abs(product - (a == b ? 1 : 0)));
        }
        REQUIRE(worst < 1e-5);
        REQUIRE(length(out.commanded_force_n) <= scene.limits.force_n);
      }
    }
  }
}

}  // namespace kerf::servo_safety_test
