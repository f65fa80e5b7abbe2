// SPDX-License-Identifier: Apache-2.0
// The energy ledger and the stabilisers in the whole servo step.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <numeric>
#include <string>

#include <doctest/doctest.h>

#include "tests/rig/cutting_hand.hpp"
#include "tests/servo/support.hpp"

namespace kerf::port_energy_test {

using namespace kerf::test;
using extremes::CuttingHand;

namespace {

constexpr std::array kEveryNumber{NumericKind::fixed, NumericKind::float64};

double mj(const ServoOutput& out, EnergySource source) {
  return energy_mj_of_steps(out.energy_steps[static_cast<std::size_t>(source)]);
}
/// Since `before`.
double mj(const ServoOutput& out, const ServoOutput& before, EnergySource source) {
  return mj(out, source) - mj(before, source);
}
std::int64_t sum_of_steps(const ServoOutput& out) {
  return std::accumulate(out.energy_steps.begin(), out.energy_steps.end(), std::int64_t{0});
}
double stored_mj(const LoadedScene& scene, const ServoOutput& out) {
  const double spring_mm = length(out.proxy_offset_mm);
  return scene.force.stiffness_n_per_mm * spring_mm * spring_mm / 2;
}

/// A mass on the Omni's own damping against the flat, pushed down by 1 N for a second.
struct HandOnFlat {
  ServoOutput last;
  double peak_n = 0, swing_mm = 0, deepest_mm = 0;
};
HandOnFlat push_on_flat(LoadedScene scene) {
  constexpr double kMassKg = 0.045, kDampingNsPerM = 0.2, kPushN = 1;
  constexpr int kSubSteps = 20, kTicks = 1500;
  ArmedServo armed(scene);
  HandOnFlat hand;
  for (int i = 0; i <= 380; ++i) hand.last = armed.step(0, 5 - 0.01 * i, 0);
  double y_mm = 1.2, v_mm_per_s = 0, low_mm = 1e9, high_mm = -1e9;
  const double step_s = 1.0 / scene.servo.rate_hz / kSubSteps;
  for (int tick = 0; tick < kTicks; ++tick) {
    hand.last = armed.step(0, std::clamp(y_mm, -20.0, 60.0), 0);
    hand.peak_n = std::max(hand.peak_n, length(hand.last.commanded_force_n));
    hand.deepest_mm = std::max(hand.deepest_mm, length(hand.last.proxy_offset_mm));
    for (int i = 0; i < kSubSteps; ++i) {
      const double force_n =
          hand.last.commanded_force_n[1] - kPushN - kDampingNsPerM * v_mm_per_s / 1000;
      v_mm_per_s += force_n / kMassKg * 1000 * step_s;
      y_mm += v_mm_per_s * step_s;
    }
    if (tick < kTicks * 2 / 3) continue;
    low_mm = std::min(low_mm, y_mm);
    high_mm = std::max(high_mm, y_mm);
  }
  hand.swing_mm = high_mm - low_mm;
  return hand;
}

}  // namespace

TEST_CASE("pressing, rubbing and leaving: each source has its own account, and all add up") {
  for (const NumericKind numeric : kEveryNumber) {
    CAPTURE(static_cast<int>(numeric));
    LoadedScene scene = half_space_scene();
    scene.servo.numeric = numeric;
    scene.force.friction = 0.3;
    scene.force.damping_ns_per_mm = 0.002;
    ArmedServo armed(scene);
    const ServoOutput air = armed.settled(0, 1.5, 0);
    CHECK(sum_of_steps(air) == 0);
    ServoOutput pressed;
    for (int i = 0; i <= 100; ++i) pressed = armed.step(0, 1.5 - 0.01 * i, 0);
    pressed = armed.settled(0, 0.5, 0);
    CHECK(mj(pressed, EnergySource::spring) ==
          doctest::Approx(stored_mj(scene, pressed)).epsilon(0.02));
    CHECK(mj(pressed, EnergySource::damping) > 0.005);
    CHECK(mj(pressed, EnergySource::leak) < 0);
    CHECK(mj(pressed, EnergySource::stabiliser) == 0);

    ServoOutput rubbed;
    for (int i = 0; i <= 200; ++i) rubbed = armed.step(0.01 * i, 0.5, 0);
    const double rubbed_n = 0.3 * std::abs(rubbed.commanded_force_n[1]);
    // Once it slips, friction takes mu F along the way; before, it stores.
    CHECK(mj(rubbed, pressed, EnergySource::friction) ==
          doctest::Approx(rubbed_n * 2).epsilon(0.2));
    CHECK(std::abs(mj(rubbed, pressed, EnergySource::spring)) < 0.01);

    ServoOutput left;
    for (int i = 0; i <= 100; ++i) left = armed.step(2, 0.5 + 0.01 * i, 0);
    CHECK(std::abs(mj(left, EnergySource::spring)) < 0.02 * stored_mj(scene, pressed));
    CHECK(left.port_minimum_mj <= left.absorbed_mj);
    CHECK(energy_mj_of_steps(sum_of_steps(left)) ==
          doctest::Approx(left.absorbed_mj).epsilon(1e-8));
    if (numeric == NumericKind::fixed) {
      CHECK(energy_mj_of_steps(sum_of_steps(left)) == left.absorbed_mj);
    }
  }
}

TEST_CASE("lost reports: the spring keeps its store, and what holding and fading cost is told") {
  for (const NumericKind numeric : {NumericKind::fixed, NumericKind::float64}) {
    for (const int lost : {1, 4, 12, 18}) {
      CAPTURE(lost);
      LoadedScene scene = half_space_scene();
      scene.servo.numeric = numeric;
      scene.force.damping_ns_per_mm = 0;
      ArmedServo armed(scene);
      const ServoOutput before = armed.settled(0, 0.4, 0);
      double sent_n = before.commanded_force_n[1];
      for (int i = 0; i < lost; ++i) {
        const ServoOutput out = armed.servo->step({});
        sent_n += out.commanded_force_n[1];
        CHECK(out.energy_steps == before.energy_steps);  // nobody knows where the hand is
      }
      const ServoOutput after = armed.step(0, 0.2, 0);
      const double moved_mm = before.position_mm[1] - after.position_mm[1];
      const double store_mj = stored_mj(scene, after) - stored_mj(scene, before);
      const double booked_mj = sent_n / (lost + 1) * moved_mm;
      const double leak_mj = mj(after, before, EnergySource::leak);
      CHECK(mj(after, before, EnergySource::spring) == doctest::Approx(store_mj).epsilon(0.01));
      CHECK(leak_mj ==
            doctest::Approx(-scene.force.stiffness_n_per_mm * moved_mm * moved_mm / 2 / (lost + 1))
                .epsilon(0.03));
      CHECK(mj(after, before, EnergySource::hold) ==
            doctest::Approx(booked_mj - store_mj - leak_mj).epsilon(0.02));
      CHECK(mj(after, before, EnergySource::hold) < 0);
      CHECK(sum_of_steps(after) - sum_of_steps(before) ==
            doctest::Approx((after.absorbed_mj - before.absorbed_mj) * kEnergyStepsPerMj));
    }
  }
}

TEST_CASE("a silence of seconds books the mean of the forces over all of its ticks") {
  for (const NumericKind numeric : {NumericKind::fixed, NumericKind::float64}) {
    for (const int lost : {500, 3000}) {
      CAPTURE(lost);
      LoadedScene scene = half_space_scene();
      scene.servo.numeric = numeric;
      ArmedServo armed(scene);
      const ServoOutput before = armed.settled(0, 0.4, 0);
      double sent_n = before.commanded_force_n[1];
      for (int i = 0; i < lost; ++i) sent_n += armed.servo->step({}).commanded_force_n[1];
      const ServoOutput after = armed.step(0, 0.2, 0);
      const double moved_mm = before.position_mm[1] - after.position_mm[1];
      const double step_n = numeric == NumericKind::fixed ? 2e-5 : 1e-9;
      CHECK(std::abs(after.absorbed_mj - before.absorbed_mj - sent_n / (lost + 1) * moved_mm) <=
            step_n * moved_mm + 1e-6);
    }
  }
}

TEST_CASE("what limits, fading in and cutting do has an account") {
  LoadedScene scene = half_space_scene();
  ArmedServo armed(scene);
  ServoOutput deep;
  for (int i = 0; i <= 500; ++i) deep = armed.step(0, 1.2 - 0.025 * i, 0);
  REQUIRE(length(deep.commanded_force_n) == doctest::Approx(3.3).epsilon(0.01));
  CHECK(mj(deep, EnergySource::limits) < -1);  // the spring was never felt whole
  CHECK(mj(deep, EnergySource::hold) == 0);
  armed.servo->apply({.kind = ServoCommand::Kind::fade_in});
  ServoOutput faded;
  for (int i = 0; i < 50; ++i) faded = armed.step(0, -11.3 - 0.02 * i, 0);
  CHECK(mj(faded, deep, EnergySource::hold) < -0.1);
  CHECK(energy_mj_of_steps(sum_of_steps(faded)) == faded.absorbed_mj);

  LoadedScene block = half_space_scene(48);
  block.cut.model = CutModel::preston;
  CuttingHand miller(block);
  static_cast<void>(miller.hold({0, 0.2, 0}, 0.1));
  ServoOutput cut;
  for (int i = 0; i < 200; ++i) cut = miller.step({0.01 * i, 0.2, 0});
  CHECK(std::abs(mj(cut, EnergySource::cutting)) > 1e-3);
  CHECK(energy_mj_of_steps(sum_of_steps(cut)) == cut.absorbed_mj);

  LoadedScene paper = paper_scene();
  ArmedServo felt(paper);
  ServoOutput sunk;
  for (int i = 0; i <= 100; ++i) sunk = felt.step(0, 1.2 - 0.01 * i, 0);
  CHECK(mj(sunk, EnergySource::spring) > 0.01);
  CHECK(energy_mj_of_steps(sum_of_steps(sunk)) == sunk.absorbed_mj);
}

TEST_CASE("a flat of 4 N/mm throws the hand, and either stabiliser holds it; the clamp holds") {
  for (const NumericKind numeric : kEveryNumber) {
    CAPTURE(static_cast<int>(numeric));
    LoadedScene scene = half_space_scene();
    scene.servo.numeric = numeric;
    scene.force.stiffness_n_per_mm = 4;
    scene.force.damping_ns_per_mm = 0;
    const HandOnFlat off = push_on_flat(scene);
    CHECK(off.last.port_minimum_mj < -5);
    CHECK(off.swing_mm > 2);
    for (const char* name : {"passivity", "energy_bounding"}) {
      CAPTURE(std::string(name));
      scene.force.stabiliser.name = name;
      const HandOnFlat on = push_on_flat(scene);
      CHECK(on.last.fault == Fault::none);
      CHECK(on.peak_n <= 3.3001);
      CHECK(on.swing_mm < off.swing_mm);
      CHECK(mj(on.last, EnergySource::stabiliser) != 0);
      CHECK(energy_mj_of_steps(sum_of_steps(on.last)) ==
            doctest::Approx(on.last.absorbed_mj).epsilon(1e-8));
      MESSAGE(name << ": port minimum " << on.last.port_minimum_mj << " mJ, swing " << on.swing_mm
                   << " mm, peak " << on.peak_n << " N; off " << off.last.port_minimum_mj << " mJ, "
                   << off.swing_mm << " mm");
    }
  }
}

}  // namespace kerf::port_energy_test
