// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <doctest/doctest.h>

#include "controller/scene/scene_error.hpp"
#include "controller/shell/allocation_counter.hpp"
#include "tests/servo/support.hpp"

using kerf::Fault;
using kerf::NumericKind;
using kerf::Phase;
using kerf::Scene;
using kerf::ServoOutput;
using kerf::test::arm_at;
using kerf::test::FakeArm;
using kerf::test::half_space_scene;

namespace {

double length(const std::array<double, 3>& v) {
  return std::hypot(v[0], v[1], v[2]);
}

/// Steady output with the tip at a device place.
ServoOutput settled(kerf::Servo& servo, FakeArm& arm, double x, double y, double z) {
  ServoOutput out;
  for (int tick = 0; tick < 20; ++tick) out = servo.step(arm.at(x, y, z));
  return out;
}

/// Ball of R = 1 mm at depth p in a flat: haptics literature, p0 pi (2 R p - p^2).
double theory_n(double p_mm) {
  return 0.06 * std::numbers::pi * (2 * p_mm - p_mm * p_mm);
}

}  // namespace

TEST_CASE("a ball in a half-space pushes straight out with the theory's force") {
  for (const NumericKind numeric :
       {NumericKind::fixed, NumericKind::float32, NumericKind::float64}) {
    Scene scene = half_space_scene();
    scene.servo.numeric = numeric;
    const auto servo = kerf::compile(scene);
    FakeArm arm;
    arm_at(*servo, arm, 0, 5, 0);
    for (const double y : {0.75, 0.5, 0.3}) {
      const ServoOutput out = settled(*servo, arm, 0, y, 0);
      const double p_mm = 1.0 - out.position_mm[1];  // where the encoders put it
      CHECK(out.force_n[1] == doctest::Approx(theory_n(p_mm)).epsilon(0.07));
      CHECK(std::abs(out.force_n[0]) < 0.01 * out.force_n[1]);
      CHECK(std::abs(out.force_n[2]) < 0.01 * out.force_n[1]);
      CHECK(servo->penetration_mm() == doctest::Approx(p_mm).epsilon(0.25));
      CHECK(out.motors_on);
    }
  }
}

TEST_CASE("no force in the air, none when immersed") {
  Scene scene = half_space_scene();
  const auto servo = kerf::compile(scene);
  FakeArm arm;
  arm_at(*servo, arm, 0, 5, 0);
  CHECK(length(settled(*servo, arm, 0, 2, 0).force_n) == 0);
  CHECK(length(settled(*servo, arm, 0, -2, 0).force_n) < 1e-4);
}

TEST_CASE("workspace scale keeps power: F_device = s F_scene at x_scene = s x_device") {
  Scene plain = half_space_scene();
  Scene scaled = half_space_scene();
  scaled.device.workspace_scale = 0.5;
  const auto servo = kerf::compile(plain);
  const auto half = kerf::compile(scaled);
  FakeArm arm;
  FakeArm other;
  arm_at(*servo, arm, 0, 5, 0);
  arm_at(*half, other, 0, 5, 0);
  const ServoOutput at_one = settled(*servo, arm, 0, 0.6, 0);
  const ServoOutput at_half = settled(*half, other, 0, 1.2, 0);
  // The counts differ by up to one: compare each with the theory at its own place.
  const double ratio_one = at_one.force_n[1] / theory_n(1 - at_one.position_mm[1]);
  const double ratio_half = at_half.force_n[1] / (0.5 * theory_n(1 - at_half.position_mm[1]));
  CHECK(ratio_half == doctest::Approx(ratio_one).epsilon(0.03));
}

TEST_CASE("turning volume and approach together turns the force with them") {
  Scene scene = half_space_scene();
  // Volume's y axis along world x: a turn by -90 degrees about z.
  auto& volume = scene.volumes[0];
  volume.pose.orientation = {0, 0, -std::sqrt(0.5), std::sqrt(0.5)};
  const auto corner = volume.pose.position_mm;
  volume.pose.position_mm = {corner[1], -corner[0], corner[2]};
  const auto servo = kerf::compile(scene);
  FakeArm arm;
  arm_at(*servo, arm, 5, 0, 0);
  const ServoOutput out = settled(*servo, arm, 0.5, 0, 0);
  const double p_mm = 1.0 - out.position_mm[0];
  CHECK(out.force_n[0] == doctest::Approx(theory_n(p_mm)).epsilon(0.07));
  CHECK(std::abs(out.force_n[1]) < 0.01 * out.force_n[0]);
}

TEST_CASE("two halves as two volumes push as one whole") {
  // The same half-space twice, each at half the density: the force is linear in density.
  Scene whole = half_space_scene();
  Scene parts = half_space_scene();
  for (auto& d : parts.volumes[0].image.density) d = static_cast<kerf::Density>(d / 2);
  parts.volumes.push_back(parts.volumes[0]);
  const auto one = kerf::compile(whole);
  const auto two = kerf::compile(parts);
  FakeArm a;
  FakeArm b;
  arm_at(*one, a, 0, 5, 0);
  arm_at(*two, b, 0, 5, 0);
  const double whole_n = settled(*one, a, 0, 0.5, 0).force_n[1];
  CHECK(settled(*two, b, 0, 0.5, 0).force_n[1] == doctest::Approx(whole_n).epsilon(1e-3));
}

TEST_CASE("force comes from the volume before this tick's cut; both forces resist") {
  Scene touch = half_space_scene();
  Scene cut = half_space_scene();
  cut.cut.model = kerf::CutModel::overlap;
  cut.cut.rate_per_s = 1000;  // the paper's own step: all of the overlap at once
  const auto feel = kerf::compile(touch);
  const auto mill = kerf::compile(cut);
  FakeArm a;
  FakeArm b;
  arm_at(*feel, a, 0, 5, 0);
  arm_at(*mill, b, 0, 5, 0);
  const ServoOutput felt = feel->step(a.at(0, 0.5, 0));
  const ServoOutput first = mill->step(b.at(0, 0.5, 0));
  CHECK(first.contact_n == felt.contact_n);
  CHECK(first.removed_steps > 0);
  CHECK(first.modification_n[1] > 0.0);
  CHECK_FALSE(first.changed[0].empty());
  const ServoOutput second = mill->step(b.at(0, 0.5, 0));
  CHECK(length(second.contact_n) < 0.7 * length(first.contact_n));
}

TEST_CASE("what leaves the volume is what the output counts") {
  Scene scene = half_space_scene();
  scene.cut.model = kerf::CutModel::overlap;
  const auto servo = kerf::compile(scene);
  const auto total = [&] {
    std::uint64_t sum = 0;
    for (const auto d : servo->density(0)) sum += d;
    return sum;
  };
  const std::uint64_t before = total();
  FakeArm arm;
  arm_at(*servo, arm, 0, 5, 0);
  std::uint64_t removed = 0;
  for (int tick = 0; tick < 500; ++tick) {
    const double angle = tick * 0.02;
    removed += servo->step(arm.at(std::cos(angle), 0.2, std::sin(angle))).removed_steps;
  }
  CHECK(removed > 0);
  CHECK(before - total() == removed);
}

TEST_CASE("fixed agrees with double within 1.7e-4 of full scale") {
  Scene fixed = half_space_scene();
  Scene exact = half_space_scene();
  exact.servo.numeric = NumericKind::float64;
  const auto a = kerf::compile(fixed);
  const auto b = kerf::compile(exact);
  FakeArm arm_a;
  FakeArm arm_b;
  arm_at(*a, arm_a, 0, 5, 0);
  arm_at(*b, arm_b, 0, 5, 0);
  const double full_scale_n = 0.06 * std::numbers::pi;  // the peak: p0 pi R^2
  for (int i = 0; i < 300; ++i) {
    const double x = 0.7 * std::sin(i * 0.31);
    const double y = 0.5 + 0.45 * std::sin(i * 0.17);
    const auto out_a = a->step(arm_a.at(x, y, 0.1));
    const auto out_b = b->step(arm_b.at(x, y, 0.1));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      REQUIRE(std::abs(out_a.contact_n[axis] - out_b.contact_n[axis]) < 1.7e-4 * full_scale_n);
    }
  }
}

TEST_CASE("reports stop: the force holds 5 ms, is zero at 20 ms, motors off, fault latched") {
  Scene scene = half_space_scene();
  const auto servo = kerf::compile(scene);
  FakeArm arm;
  arm_at(*servo, arm, 0, 5, 0);
  const double held_n = length(settled(*servo, arm, 0, 0.3, 0).force_n);
  REQUIRE(held_n > 0.1);
  for (int ms = 1; ms <= 25; ++ms) {
    const ServoOutput out = servo->step({});
    CAPTURE(ms);
    if (ms <= 5) CHECK(length(out.force_n) == doctest::Approx(held_n).epsilon(1e-3));
    if (ms > 5) CHECK(length(out.force_n) < held_n);
    if (ms >= 20) {
      CHECK(length(out.force_n) == 0);
      CHECK_FALSE(out.motors_on);
      CHECK(out.fault == Fault::stale_input);
      CHECK(out.motor_counts == std::array<std::int16_t, 3>{});
    }
  }
  CHECK(settled(*servo, arm, 0, 0.3, 0).phase == Phase::fault);  // stays off
  arm_at(*servo, arm, 0, 5, 0);                                  // until docked again
  CHECK(length(settled(*servo, arm, 0, 0.3, 0).force_n) > 0.1);
}

TEST_CASE("one packet with the docked bit neither moves the tip nor forgives a fault") {
  Scene scene = half_space_scene();
  const auto servo = kerf::compile(scene);
  FakeArm arm;
  arm_at(*servo, arm, 0, 5, 0);
  const ServoOutput before = settled(*servo, arm, 0, 0.3, 0);
  auto glitch = arm.at(0, 0.3, 0);
  glitch.parked = true;
  CHECK_FALSE(servo->step(glitch).motors_on);
  const ServoOutput after = servo->step(arm.at(0, 0.3, 0));
  CHECK(after.position_mm == before.position_mm);
  CHECK(length(after.force_n) < 0.1 * length(before.force_n));  // fades in again
  for (int ms = 0; ms < 30; ++ms) static_cast<void>(servo->step({}));
  glitch = arm.at(0, 0.3, 0);
  glitch.parked = true;
  CHECK(servo->step(glitch).fault == Fault::stale_input);
  CHECK_FALSE(servo->step(arm.at(0, 0.3, 0)).motors_on);
}

TEST_CASE("a stylus that moves while the docked bit is set is not calibrated") {
  Scene scene = half_space_scene();
  const auto servo = kerf::compile(scene);
  FakeArm arm;
  for (int tick = 0; tick < 100; ++tick) {
    auto report = arm.at(0, -30 + tick * 0.5, 0);
    report.parked = true;
    CHECK(servo->step(report).phase == Phase::calibrating);
  }
}

TEST_CASE("after a stall the force starts again from nothing") {
  Scene scene = half_space_scene();
  scene.force.p0_n_per_mm2 = 50;
  const auto servo = kerf::compile(scene);
  FakeArm arm;
  arm_at(*servo, arm, 0, 5, 0);
  REQUIRE(length(settled(*servo, arm, 0, 0.3, 0).force_n) > 3);
  servo->apply({.kind = kerf::ServoCommand::Kind::fade_in});
  double last_n = 0;
  for (int tick = 0; tick < 20; ++tick) {
    const double force_n = length(servo->step(arm.at(0, 0.3, 0)).force_n);
    CHECK(force_n <= last_n + 0.5 + 1e-4);
    last_n = force_n;
  }
}

TEST_CASE("a force beyond the motors keeps its direction, and what was sent is what is told") {
  Scene scene = half_space_scene();
  scene.force.p0_n_per_mm2 = 50;
  scene.device.torque_scale = std::array{0.01, 0.01, 0.01};  // the range ends at 20 N mm
  const auto servo = kerf::compile(scene);
  FakeArm arm;
  arm_at(*servo, arm, 0, 5, 0);
  const ServoOutput out = settled(*servo, arm, 0.2, 0.3, 0.2);
  CHECK(out.saturated);
  CHECK(length(out.force_n) < 1);
  int largest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    largest = std::max(largest, std::abs(int{out.motor_counts[i]}));
    CHECK(out.motor_counts[i] * 0.01 == doctest::Approx(out.torque_n_mm[i]).epsilon(0.01));
  }
  CHECK(largest == 2047);
}

TEST_CASE("a force that is not finite ends the motors at once") {
  Scene scene = half_space_scene();
  scene.servo.numeric = NumericKind::float64;
  scene.force.p0_n_per_mm2 = std::numeric_limits<double>::quiet_NaN();
  const auto servo = kerf::compile(scene);
  FakeArm arm;
  arm_at(*servo, arm, 0, 5, 0);
  const ServoOutput out = settled(*servo, arm, 0, 0.3, 0);
  CHECK(out.fault == Fault::not_finite);
  CHECK_FALSE(out.motors_on);
  CHECK(out.motor_counts == std::array<std::int16_t, 3>{});
}

TEST_CASE("voxels too fine for fixed point are refused, not felt wrongly") {
  Scene scene = half_space_scene(16);
  scene.volumes[0].image.spacing_mm = {0.004, 0.004, 0.004};
  CHECK_THROWS_WITH_AS(static_cast<void>(kerf::compile(scene)), doctest::Contains("resample"),
                       kerf::SceneError);
}

TEST_CASE("faster than 10 m/s: motors off in the same tick") {
  Scene scene = half_space_scene();
  const auto servo = kerf::compile(scene);
  FakeArm arm;
  arm_at(*servo, arm, 0, 5, 0);
  REQUIRE(settled(*servo, arm, 0, 0.3, 0).motors_on);
  const ServoOutput out = servo->step(arm.at(0, 15.0, 0));
  CHECK(out.fault == Fault::overspeed);
  CHECK_FALSE(out.motors_on);
  CHECK(length(out.force_n) == 0);
}

TEST_CASE("a scene without torque scale feels, but never turns the motors on") {
  Scene scene = half_space_scene();
  scene.device.torque_scale.reset();
  const auto servo = kerf::compile(scene);
  FakeArm arm;
  arm_at(*servo, arm, 0, 5, 0);
  const ServoOutput out = settled(*servo, arm, 0, 0.3, 0);
  CHECK(length(out.contact_n) > 0.1);
  CHECK_FALSE(out.motors_on);
  CHECK(length(out.force_n) == 0);
}

TEST_CASE("a very stiff scene meets every limit and keeps the force below 3.3 N") {
  Scene scene = half_space_scene();
  scene.force.p0_n_per_mm2 = 50;
  const auto servo = kerf::compile(scene);
  FakeArm arm;
  arm_at(*servo, arm, 0, 5, 0);
  std::array<double, 3> last{};
  for (int tick = 0; tick < 200; ++tick) {
    const ServoOutput out = servo->step(arm.at(0, tick < 100 ? 0.0 : 5.0, 0));
    CHECK(length(out.force_n) <= 3.3);
    CHECK(std::hypot(out.force_n[0] - last[0], out.force_n[1] - last[1],
                     out.force_n[2] - last[2]) <= 0.5 + 1e-4);
    for (const auto counts : out.motor_counts) CHECK(std::abs(counts) <= 2047);
    last = out.force_n;
  }
}

TEST_CASE("the tool changes at a tick boundary, to a known index only") {
  Scene scene = half_space_scene();
  scene.tools.push_back(kerf::test::ball(10));
  const auto servo = kerf::compile(scene);
  FakeArm arm;
  arm_at(*servo, arm, 0, 5, 0);
  const double large_n = settled(*servo, arm, 0, 0.4, 0).force_n[1];
  using Command = kerf::ServoCommand;
  servo->apply({Command::Kind::select_tool, 1});
  const ServoOutput out = settled(*servo, arm, 0, 0.4, 0);
  CHECK(out.active_tool == 1);
  CHECK(out.force_n[1] < 0.8 * large_n);
  servo->apply({Command::Kind::select_tool, 2});
  CHECK(settled(*servo, arm, 0, 0.4, 0).active_tool == 1);
}

TEST_CASE("hold gives no force and cuts nothing") {
  Scene scene = half_space_scene();
  scene.cut.model = kerf::CutModel::overlap;
  const auto servo = kerf::compile(scene);
  FakeArm arm;
  arm_at(*servo, arm, 0, 5, 0);
  servo->apply({kerf::ServoCommand::Kind::hold, 1});
  const ServoOutput out = settled(*servo, arm, 0, 0.4, 0);
  CHECK(length(out.force_n) == 0);
  CHECK(out.removed_steps == 0);
}

TEST_CASE("two runs of the same reports give the same bits; another motion gives others") {
  const auto run = [](double radius_mm) {
    Scene scene = half_space_scene();
    scene.cut.model = kerf::CutModel::overlap;
    const auto servo = kerf::compile(scene);
    FakeArm arm;
    arm_at(*servo, arm, 0, 5, 0);
    ServoOutput out;
    for (int tick = 0; tick < 1000; ++tick) {
      out = servo->step(arm.at(radius_mm * std::cos(tick * 0.01), 0.4, std::sin(tick * 0.01)));
    }
    return out.output_hash;
  };
  CHECK(run(1.0) == run(1.0));
  CHECK(run(1.0) != run(1.1));
}

TEST_CASE("ten seconds of cutting never touch the heap") {
  Scene scene = half_space_scene();
  scene.cut.model = kerf::CutModel::overlap;
  const auto servo = kerf::compile(scene);
  FakeArm arm;
  arm_at(*servo, arm, 0, 5, 0);
#ifdef KERF_SANITIZED
  MESSAGE("skipped under sanitizers: the allocation counter");
#endif
  const std::uint64_t before = kerf::CountedAllocations::total();
  double sum_n = 0;
  {
    const kerf::CountedAllocations counted;
    for (int tick = 0; tick < 10'000; ++tick) {
      const double angle = tick * 0.002;
      sum_n += servo->step(arm.at(std::cos(angle), 0.4, std::sin(angle))).force_n[1];
    }
  }
  CHECK(sum_n > 0);
  CHECK(kerf::CountedAllocations::total() == before);
}

#ifndef KERF_SANITIZED
TEST_CASE("the allocation counter sees an allocation") {
  const std::uint64_t before = kerf::CountedAllocations::total();
  {
    const kerf::CountedAllocations counted;
    for (int i = 0; i < 20; ++i) {
      void* volatile block = ::operator new(16);
      ::operator delete(block);
    }
  }
  CHECK(kerf::CountedAllocations::total() == before + 20);
}
#endif
