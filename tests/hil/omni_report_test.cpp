// SPDX-License-Identifier: Apache-2.0
// What the model puts on the wire: encoders, pots, buttons, inkwell.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <doctest/doctest.h>

#include "hil/device/omni.hpp"
#include "shared/wire/omni.hpp"
#include "tests/hil/model_runs.hpp"

namespace {

using kerf::HandGoal;
using kerf::OmniCommand;
using kerf::OmniModel;
using kerf::OmniParams;
using kerf::test::at;
using kerf::test::kSecond;
using kerf::test::run;

}  // namespace

TEST_CASE("the inkwell is left with the hand and found again to the same counts") {
  OmniModel model;
  const auto docked = model.next_report();
  run(model, at({0, 5, 0}), kSecond);
  CHECK_FALSE(model.next_report().docked);
  run(model, {}, 2 * kSecond);  // back: the inkwell catches within 2 mm
  const auto again = model.next_report();
  CHECK(again.docked);
  CHECK(again.encoder == docked.encoder);
}

TEST_CASE("encoders are the floor of the joint angle, and wrap at 16 bits") {
  OmniParams params;
  OmniModel model(params);
  std::array<int, 3> wraps{};
  auto last = model.next_report().encoder;
  for (int i = 0; i < 4 * kSecond; ++i) {
    const double t = static_cast<double>(i) / kSecond;
    model.step(at({20 * std::sin(6 * t), 20 * std::sin(5 * t), 20 * std::sin(4 * t)}));
    if (i % 8 != 0) continue;
    const auto now = model.next_report().encoder;
    const auto q = model.joints_rad();
    const std::array<double, 3> turned{q.x - params.dock_rad[0], -(q.y - params.dock_rad[1]),
                                       q.z - params.dock_rad[2]};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double counts = turned[axis] * 15000 / (2 * kerf::omni::kPi);
      const int floor_count = params.encoder_offset[axis] + static_cast<int>(std::floor(counts));
      const int wrapped = ((floor_count + 32768) % 65536 + 65536) % 65536 - 32768;
      CHECK(now[axis] == wrapped);
      if (std::abs(now[axis] - last[axis]) > 32768) ++wraps[axis];
    }
    last = now;
  }
  for (const int count : wraps) CHECK(count >= 1);
}

TEST_CASE("a host that unwraps and inverts the counts finds the tip within a few hundredths mm") {
  const OmniParams params;
  OmniModel model(params);
  auto last = model.next_report().encoder;
  std::array<int, 3> unwrapped{};
  double worst_mm = 0;
  for (int i = 0; i < 3 * kSecond; ++i) {
    const double t = static_cast<double>(i) / kSecond;
    model.step(at({15 * std::sin(7 * t), 8 * std::cos(5 * t), 15 * std::cos(7 * t)}));
    if (i % 8 != 0) continue;
    const auto now = model.next_report().encoder;
    std::array<double, 3> q{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      unwrapped[axis] += static_cast<std::int16_t>(now[axis] - last[axis]);
      q[axis] = params.dock_rad[axis] +
                kerf::omni::kEncoderSign[axis] * kerf::omni::kRadPerCount * unwrapped[axis];
    }
    last = now;
    worst_mm = std::max(worst_mm, norm(model.arm().tip_mm({q[0], q[1], q[2]}) - model.tip_mm()));
  }
  // One count is 0.056 mm at the end of one link and 0.09 at full reach; three of them at most.
  CHECK(worst_mm > 0.01);
  CHECK(worst_mm < 0.2);
}

TEST_CASE("gimbal pots carry the orientation, and an upright shaft stays upright") {
  OmniModel model;
  HandGoal goal = at({4, 5, -6});
  goal.orientation_rad = {0.3, -0.2, 1.1};
  run(model, goal, kSecond);
  const auto report = model.next_report();
  const auto angle = [&](std::size_t axis) {
    const double a = report.pot_a[axis], b = report.pot_b[axis];
    return kerf::omni::kGimbalSlopeRad[axis] * a / (a + b) + kerf::omni::kGimbalOffsetRad[axis];
  };
  constexpr double kPotStepRad = 5.48 / 65536;
  CHECK(std::abs(angle(0) - 0.3) < kPotStepRad);
  CHECK(std::abs(angle(1) - (model.joints_rad().z - 0.2)) < kPotStepRad);
  CHECK(std::abs(angle(2) - 1.1) < kPotStepRad);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    CHECK(report.pot_a[axis] + report.pot_b[axis] == 65536);
  }
}

TEST_CASE("angles beyond a pot stay at its end") {
  OmniModel model;
  HandGoal goal;
  goal.orientation_rad = {9.0, -9.0, -9.0};
  model.step(goal);
  const auto report = model.next_report();
  CHECK(report.pot_a[0] == 65535);
  CHECK(report.pot_a[1] == 65535);  // the pitch pot runs the other way
  CHECK(report.pot_a[2] == 1);
}

TEST_CASE("pot noise moves the low 5 bits only, by its seed") {
  OmniParams params;
  OmniModel clean(params);
  params.pot_noise = true;
  OmniModel noisy(params);
  OmniModel same(params);
  params.seed = 2;
  OmniModel other(params);
  bool changed = false;
  bool seeds_differ = false;
  for (int i = 0; i < 100; ++i) {
    const auto a = clean.next_report();
    const auto b = noisy.next_report();
    CHECK(b == same.next_report());
    seeds_differ |= !(b == other.next_report());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      CHECK((a.pot_a[axis] >> 5) == (b.pot_a[axis] >> 5));
      CHECK((a.pot_b[axis] >> 5) == (b.pot_b[axis] >> 5));
      changed |= a.pot_a[axis] != b.pot_a[axis];
    }
  }
  CHECK(changed);
  CHECK(seeds_differ);
}

TEST_CASE("buttons and light pass through, and every report counts one packet") {
  OmniModel model;
  HandGoal goal;
  goal.button2 = true;
  model.step(goal);
  const auto first = model.next_report();
  CHECK_FALSE(first.button1);
  CHECK(first.button2);
  CHECK(first.counter == 1);
  CHECK(model.next_report().counter == 2);
  model.command({{}, false, OmniCommand::Light::slow_flash});
  CHECK(model.light() == OmniCommand::Light::slow_flash);
  CHECK_FALSE(model.motors_on());
}
