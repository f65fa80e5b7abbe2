// SPDX-License-Identifier: Apache-2.0
// Inertia in the joints, rigid and behind a structural mode, seen through an Omni.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include <doctest/doctest.h>

#include "hil/device/omni.hpp"
#include "hil/device/plant.hpp"
#include "tests/hil/model_runs.hpp"

namespace {

using kerf::DeviceVec;
using kerf::OmniCommand;
using kerf::OmniModel;
using kerf::OmniParams;
using kerf::test::at;
using kerf::test::kSecond;
using kerf::test::run;

constexpr double kInertia = 1e-3;  // kg m^2, as much as 56 g at one link

/// A free tip without friction, and motors with inertia.
OmniParams free_arm() {
  OmniParams params;
  params.viscous_ns_per_mm = 0;
  params.coulomb_n = 0;
  params.hand_stiffness_n_per_mm = 0;
  params.hand_damping_ns_per_mm = 0;
  params.hand_mass_kg = 0;
  params.joint_inertia_kg_m2 = {kInertia, kInertia, kInertia};
  return params;
}

void push(OmniModel& model, std::int16_t count) {
  model.command({{count, count, count}, true, OmniCommand::Light::steady});
}

double energy_mj(const OmniModel& model, double mass_kg) {
  const auto v = model.velocity_mm_per_s();
  const auto w = model.arm().joint_rates(model.joints_rad(), v);
  return mass_kg * dot(v, v) * 1e-3 / 2 + kInertia * dot(w, w) * 1e3 / 2;
}

}  // namespace

TEST_CASE("rigid rotors add J^-T I J^-1 to the tip's mass") {
  OmniModel model(free_arm());
  push(model, 200);
  const int cycles = kSecond / 500;
  run(model, at({}), cycles);
  const auto force = model.motor_force_n();
  const auto v = model.velocity_mm_per_s();
  const auto q = model.joints_rad();
  const auto w = model.arm().joint_rates(q, v);
  // Momentum of tip and rotors after 2 ms of nearly constant force, in N s.
  const auto momentum = v * (0.045 / 1000) + model.arm().tip_force_n(q, w * (kInertia * 1000));
  const auto impulse = force * (static_cast<double>(cycles) / kSecond);
  CHECK(norm(momentum - impulse) < 0.01 * norm(impulse));
  CHECK(norm(v * (0.045 / 1000)) < 0.8 * norm(impulse));  // the rotors carry their part
}

TEST_CASE("a coasting arm with rigid rotors keeps its energy and gains none") {
  OmniModel model(free_arm());
  push(model, 60);
  run(model, at({}), kSecond / 10);
  push(model, 0);
  run(model, at({}), 1);
  const double before = energy_mj(model, 0.045);
  CHECK(before > 0.1);
  const auto from = model.joints_rad();
  double last = before;
  for (int cycle = 0; cycle < kSecond / 4; ++cycle) {
    model.step(at({}));
    const double now = energy_mj(model, 0.045);
    CHECK(now <= last * (1 + 1e-6));
    last = now;
  }
  CHECK(norm(model.joints_rad() - from) > 0.1);  // far enough for J to change
  CHECK(last > 0.99 * before);
}

TEST_CASE("a structural mode rings with its frequency while the link is held") {
  OmniParams params = free_arm();
  params.mode_hz = 20;
  params.mode_damping_ratio = 0.01;
  OmniModel model(params);
  push(model, 2000);
  run(model, {}, kSecond / 80);  // a quarter of a period
  push(model, 0);
  int crossings = 0;
  const int zero = params.encoder_offset[0];
  int highest = 0;
  int late_highest = 0;
  int last = 0;
  for (int cycle = 0; cycle < kSecond; ++cycle) {
    model.step({});
    const int count = static_cast<std::int16_t>(model.next_report().encoder[0] - zero);
    if (last < 0 && count >= 0) ++crossings;
    highest = std::max(highest, count);
    if (cycle > kSecond * 3 / 4) late_highest = std::max(late_highest, count);
    last = count;
  }
  CHECK(model.docked());
  CHECK(std::abs(crossings - 20) <= 1);
  CHECK(highest > 50);
  CHECK(late_highest < 0.5 * highest);
}

TEST_CASE("behind a stiff mode the arm moves as with rigid rotors") {
  OmniParams params = free_arm();
  OmniModel rigid(params);
  params.mode_hz = 500;
  params.mode_damping_ratio = 0.1;
  OmniModel stiff(params);
  for (OmniModel* model : {&rigid, &stiff}) {
    push(*model, 60);
    run(*model, at({}), kSecond / 10);
  }
  const auto moved = rigid.tip_mm() - rigid.dock_tip_mm();
  CHECK(norm(moved) > 3);
  CHECK(norm(stiff.tip_mm() - rigid.tip_mm()) < 0.03 * norm(moved));
}
