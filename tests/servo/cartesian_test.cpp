// SPDX-License-Identifier: Apache-2.0
// The servo on a Cartesian device: position and orientation as reported, force out in newtons.
#include "shared/wire/cartesian.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "controller/servo/kinematics.hpp"
#include "tests/rig/kinematic_hand.hpp"
#include "tests/servo/support.hpp"

namespace kerf::cartesian_test {

using namespace kerf::test;
using ranges::KinematicHand;

namespace {

/// The flat of `half_space_scene` under a Cartesian device that was parked and led above it.
struct Arm {
  explicit Arm(Personality personality, NumericKind numeric = NumericKind::fixed,
               double force_n = 3.3)
      : scene(half_space_scene()) {
    scene.device.personality = personality;
    scene.device.torque_scale = std::array{1.0, 1.0, 1.0};
    scene.servo.numeric = numeric;
    scene.limits = {
        .force_n = force_n,
        .continuous_force_n = std::min(force_n, force_figures(personality).continuous_n),
        .slew_n_per_ms = force_figures(personality).slew_n_per_ms};
    servo = compile(scene);
    hand.emplace(scene.device);
    for (int tick = 0; tick < kDockTicks; ++tick) step({0, 5, 0}, true);
  }
  ServoOutput step(DeviceVec<double> tip_mm, bool parked = false) {
    return servo->step(hand->report(hand->counts_at(tip_mm), parked));
  }
  /// Goes straight down to `y_mm` within `ticks`, and stays as long.
  ServoOutput press(double y_mm, int ticks) {
    ServoOutput out;
    for (int tick = 1; tick <= 2 * ticks; ++tick) {
      const double part = std::min(1.0, tick / double(ticks));
      out = step({0, 5 + (y_mm - 5) * part, 0});
    }
    return out;
  }

  LoadedScene scene;
  std::unique_ptr<AnyServo> servo;
  std::optional<KinematicHand> hand;
};

}  // namespace

TEST_CASE("the turn of a quaternion is the textbook's, whatever its length, in all numbers") {
  const auto check = [](const std::array<std::int16_t, 4>& q) {
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    const double n = x * x + y * y + z * z + w * w;
    const double want[3][3] = {
        {1 - 2 * (y * y + z * z) / n, 2 * (x * y - w * z) / n, 2 * (x * z + w * y) / n},
        {2 * (x * y + w * z) / n, 1 - 2 * (x * x + z * z) / n, 2 * (y * z - w * x) / n},
        {2 * (x * z - w * y) / n, 2 * (y * z + w * x) / n, 1 - 2 * (x * x + y * y) / n}};
    const auto fixed = rotation_of<FixedNumbers>(q);
    const auto wide = rotation_of<DoubleNumbers>(q);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        if (std::abs(static_cast<double>(wide.row[i][j]) - want[i][j]) > 1e-15) return false;
        if (std::abs(static_cast<double>(fixed.row[i][j]) - want[i][j]) > 1e-9) return false;
      }
    }
    return true;
  };
  CHECK(check({0, 0, 0, 32767}));
  CHECK(check({INT16_MIN, INT16_MIN, INT16_MIN, INT16_MIN}));
  CHECK(check({0, 0, 1, 0}));
  CHECK(rc::check([&](std::array<std::int16_t, 4> q) {
    RC_PRE(q != (std::array<std::int16_t, 4>{}));
    RC_ASSERT(check(q));
  }));
  CHECK(rotation_of<FixedNumbers>({}).row == identity_rotation<FixedNumbers>().row);
}

TEST_CASE("the tip is what the device reports, and its force comes out in mN along each axis") {
  for (const Personality personality :
       {Personality::inverse3, Personality::touch, Personality::omega}) {
    for (const NumericKind numeric : {NumericKind::fixed, NumericKind::float64}) {
      CAPTURE(word_of(personality));
      Arm arm(personality, numeric);
      const ServoOutput out = arm.press(-2, 300);
      CHECK(out.motors_on);
      const double y = out.position_mm[1] - arm.scene.device.offset_mm[1];
      CHECK(y == doctest::Approx(-2).epsilon(0.001));
      CHECK(out.commanded_force_n[1] > 0.9);  // 0.4 N/mm over the 3 mm of ball and press
      for (std::size_t i = 0; i < 3; ++i) {
        CHECK(std::abs(out.dac_counts[i] - out.commanded_force_n[i] * 1000) <= 0.51);
      }
    }
  }
}

TEST_CASE("a Cartesian device gives its own peak, and no more") {
  for (const auto& [personality, peak_n] :
       {std::pair{Personality::inverse3, 10.0}, {Personality::omega, 12.0}}) {
    CAPTURE(word_of(personality));
    for (const NumericKind numeric : {NumericKind::fixed, NumericKind::float64}) {
      Arm arm(personality, numeric, peak_n);
      const ServoOutput out = arm.press(-40, 400);
      CHECK(length(out.commanded_force_n) <= peak_n);
      CHECK(length(out.commanded_force_n) > (personality == Personality::omega ? 11.9 : 9.0));
      CHECK(std::ranges::max(out.dac_counts) <= peak_n * 1000);
    }
  }
}

TEST_CASE("a Cartesian device that rests elsewhere than in its inkwell is a wrong dock") {
  const auto fault_after = [](Personality personality, double moved_mm) {
    Arm arm(personality);
    static_cast<void>(arm.press(4, 100));
    ServoOutput out;
    for (int tick = 0; tick < 2 * kDockTicks; ++tick) out = arm.step({0, 5 + moved_mm, 0}, true);
    return out.fault;
  };
  CHECK(fault_after(Personality::touch, 2.5) == Fault::none);
  CHECK(fault_after(Personality::touch, 4) == Fault::wrong_dock);
  CHECK(fault_after(Personality::omega, 30) == Fault::none);
  CHECK(fault_after(Personality::inverse3, 200) == Fault::none);
}

TEST_CASE("from one end of the counts to the other is a jump, not a step over the wrap") {
  Arm arm(Personality::inverse3);
  ServoOutput out = arm.press(5, 120);
  REQUIRE(out.motors_on);
  for (double x = 0; x < 327; x += 2) out = arm.step({x, 5, 0});
  REQUIRE(out.fault == Fault::none);
  out = arm.step({-327, 5, 0});
  CHECK(out.fault == Fault::overspeed);
  CHECK_FALSE(out.motors_on);
}

TEST_CASE("a rest is counted in steps of the device's resolution") {
  const auto calibrates = [](Personality personality, int jitter_um) {
    LoadedScene scene = half_space_scene();
    scene.device.personality = personality;
    KinematicHand hand(scene.device);
    const auto servo = compile(scene);
    ServoOutput out;
    for (int tick = 0; tick < 2 * kDockTicks; ++tick) {
      const double y = 5 + (tick % 2) * jitter_um / 1000.0;
      out = servo->step(hand.report(hand.counts_at({0, y, 0}), true));
    }
    return out.phase == Phase::armed;
  };
  CHECK(calibrates(Personality::touch, 110));
  CHECK_FALSE(calibrates(Personality::touch, 130));
  CHECK(calibrates(Personality::inverse3, 20));
  CHECK_FALSE(calibrates(Personality::inverse3, 30));
}

TEST_CASE("a tool turns with the orientation that the device reports") {
  Arm arm(Personality::touch);
  arm.hand->turn_wrist(1.0);  // a quarter turn about the shaft
  LoadedScene scene = half_space_scene();
  scene.device = arm.scene.device;
  SceneTool bar = ball(16);
  bar.round = false;
  scene.tools = {bar};
  const auto servo = compile(scene);
  ServoOutput out;
  for (int tick = 0; tick < kDockTicks; ++tick) {
    out = servo->step(arm.hand->report(arm.hand->counts_at({0, 5, 0}), true));
  }
  CHECK(out.rotation[2] == doctest::Approx(1).epsilon(1e-4));  // z of the tool points along x
  CHECK(out.rotation[6] == doctest::Approx(-1).epsilon(1e-4));
  CHECK(out.rotation[4] == doctest::Approx(1).epsilon(1e-4));
}

}  // namespace kerf::cartesian_test
