// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <numbers>

#include <doctest/doctest.h>

#include "controller/input/load_error.hpp"
#include "controller/loop/allocation_counter.hpp"
#include "tests/servo/support.hpp"

namespace kerf::servo_step_test {

using namespace kerf::test;

namespace {

/// Ball of R = 1 mm at depth d in a flat: haptics literature, p0 pi (2 R d - d^2).
double theory_n(double p_mm) {
  return 0.06 * std::numbers::pi * (2 * p_mm - p_mm * p_mm);
}

}  // namespace

TEST_CASE("a ball in a half-space pushes straight out with the theory's force") {
  for (const NumericKind numeric : {NumericKind::fixed, NumericKind::float64}) {
    LoadedScene scene = paper_scene();
    scene.servo.numeric = numeric;
    ArmedServo armed(scene);
    for (const double y : {0.75, 0.5, 0.3}) {
      const ServoOutput out = armed.settled(0, y, 0);
      const double p_mm = 1.0 - out.position_mm[1];  // where the encoders put it
      CHECK(out.commanded_force_n[1] == doctest::Approx(theory_n(p_mm)).epsilon(0.07));
      CHECK(std::abs(out.commanded_force_n[0]) < 0.01 * out.commanded_force_n[1]);
      CHECK(std::abs(out.commanded_force_n[2]) < 0.01 * out.commanded_force_n[1]);
      CHECK(armed.servo->penetration_mm() == doctest::Approx(p_mm).epsilon(0.25));
      CHECK(out.motors_on);
    }
  }
}

TEST_CASE("no force in the air, none when immersed") {
  LoadedScene scene = paper_scene();
  ArmedServo armed(scene);
  CHECK(length(armed.settled(0, 2, 0).commanded_force_n) == 0);
  CHECK(length(armed.settled(0, -2, 0).commanded_force_n) < 1e-4);
}

TEST_CASE("workspace scale keeps power: F_device = s F_scene at x_scene = s x_device") {
  LoadedScene plain = paper_scene();
  LoadedScene scaled = paper_scene();
  scaled.device.workspace_scale = 0.5;
  ArmedServo one(plain);
  ArmedServo half(scaled);
  const ServoOutput at_one = one.settled(0, 0.6, 0);
  const ServoOutput at_half = half.settled(0, 1.2, 0);
  // The counts differ by up to one: compare each with the theory at its own place.
  const double ratio_one = at_one.commanded_force_n[1] / theory_n(1 - at_one.position_mm[1]);
  const double ratio_half =
      at_half.commanded_force_n[1] / (0.5 * theory_n(1 - at_half.position_mm[1]));
  CHECK(ratio_half == doctest::Approx(ratio_one).epsilon(0.03));
}

TEST_CASE("turning volume and approach together turns the force with them") {
  LoadedScene scene = paper_scene();
  // Volume's y axis along world x: a turn by -90 degrees about z.
  auto& volume = scene.volumes[0];
  volume.pose.orientation = {0, 0, -std::sqrt(0.5), std::sqrt(0.5)};
  const auto corner = volume.pose.position_mm;
  volume.pose.position_mm = {corner[1], -corner[0], corner[2]};
  ArmedServo armed(scene, {5, 0, 0});
  const ServoOutput out = armed.settled(0.5, 0, 0);
  const double p_mm = 1.0 - out.position_mm[0];
  CHECK(out.commanded_force_n[0] == doctest::Approx(theory_n(p_mm)).epsilon(0.07));
  CHECK(std::abs(out.commanded_force_n[1]) < 0.01 * out.commanded_force_n[0]);
}

TEST_CASE("two halves as two volumes push as one whole") {
  // The same half-space twice, each at half the density: the force is linear in density.
  LoadedScene whole = paper_scene();
  LoadedScene parts = paper_scene();
  for (auto& d : parts.volumes[0].image.density) d = static_cast<Density>(d / 2);
  parts.volumes.push_back(parts.volumes[0]);
  ArmedServo one(whole);
  ArmedServo two(parts);
  const double whole_n = one.settled(0, 0.5, 0).commanded_force_n[1];
  CHECK(two.settled(0, 0.5, 0).commanded_force_n[1] == doctest::Approx(whole_n).epsilon(1e-3));
}

TEST_CASE("force comes from the volume before this tick's cut; both forces resist") {
  LoadedScene touch = paper_scene();
  LoadedScene cut = paper_scene();
  cut.cut.model = CutModel::overlap;
  cut.cut.rate_per_s = 1000;  // the paper's own step: all of the overlap at once
  ArmedServo feel(touch);
  ArmedServo mill(cut);
  const ServoOutput felt = feel.step(0, 0.5, 0);
  const ServoOutput first = mill.step(0, 0.5, 0);
  CHECK(first.contact_force_n == felt.contact_force_n);
  CHECK(first.removed_steps > 0);
  CHECK(first.modification_n[1] > 0.0);
  CHECK_FALSE(first.changed[0].empty());
  const ServoOutput second = mill.step(0, 0.5, 0);
  CHECK(length(second.contact_force_n) < 0.7 * length(first.contact_force_n));
}

TEST_CASE("what leaves the volume is what the output counts") {
  LoadedScene scene = paper_scene();
  scene.cut.model = CutModel::overlap;
  ArmedServo armed(scene);
  const auto total = [&] {
    std::uint64_t sum = 0;
    for (const auto d : armed.servo->density(0)) sum += d;
    return sum;
  };
  const std::uint64_t before = total();
  std::uint64_t removed = 0;
  for (int tick = 0; tick < 500; ++tick) {
    const double angle = tick * 0.02;
    removed += armed.step(std::cos(angle), 0.2, std::sin(angle)).removed_steps;
  }
  CHECK(removed > 0);
  CHECK(before - total() == removed);
}

TEST_CASE("voxels too fine for fixed point are refused, not felt wrongly") {
  LoadedScene scene = paper_scene(16);
  scene.volumes[0].image.spacing_mm = {0.004, 0.004, 0.004};
  CHECK_THROWS_WITH_AS(static_cast<void>(compile(scene)), doctest::Contains("resample"), LoadError);
}

TEST_CASE("the tool changes at a tick boundary, to a known index only") {
  LoadedScene scene = paper_scene();
  scene.tools.push_back(ball(10));
  ArmedServo armed(scene);
  const double large_n = armed.settled(0, 0.4, 0).commanded_force_n[1];
  armed.servo->apply({ServoCommand::Kind::select_tool, 1});
  const ServoOutput out = armed.settled(0, 0.4, 0);
  CHECK(out.active_tool == 1);
  CHECK(out.commanded_force_n[1] < 0.8 * large_n);
  armed.servo->apply({ServoCommand::Kind::select_tool, 2});
  CHECK(armed.settled(0, 0.4, 0).active_tool == 1);
}

TEST_CASE("ten seconds of cutting never touch the heap") {
  LoadedScene scene = half_space_scene();
  scene.cut.model = CutModel::preston;
  ArmedServo armed(scene);
#ifdef KERF_SANITIZED
  MESSAGE("skipped: under sanitizers, the allocation counter");
#endif
  const std::uint64_t before = CountedAllocations::total();
  double sum_n = 0;
  {
    const CountedAllocations counted;
    for (int tick = 0; tick < 10'000; ++tick) {
      const double angle = tick * 0.002;
      sum_n += armed.step(std::cos(angle), 0.4, std::sin(angle)).commanded_force_n[1];
    }
  }
  CHECK(sum_n > 0);
  CHECK(CountedAllocations::total() == before);
}

#ifndef KERF_SANITIZED
TEST_CASE("the allocation counter sees an allocation") {
  const std::uint64_t before = CountedAllocations::total();
  {
    const CountedAllocations counted;
    for (int i = 0; i < 20; ++i) {
      void* volatile block = ::operator new(16);
      ::operator delete(block);
    }
  }
  CHECK(CountedAllocations::total() == before + 20);
}
#endif

}  // namespace kerf::servo_step_test
