// SPDX-License-Identifier: Apache-2.0
// The mechanics of an emulated arm: the tip's mass and friction alone; motors, hand, rotors and
// delays through an Omni.
#include "hil/device/plant.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "controller/stability/sampled_loop.hpp"
#include "hil/device/omni.hpp"
#include "tests/hil/model_runs.hpp"

namespace kerf::plant_test {
namespace {

using kerf::test::at;
using kerf::test::kSecond;
using kerf::test::push;
using kerf::test::run;

constexpr double kStepS = 1.0 / 32000;
constexpr double kMassKg = 0.045;
constexpr double kInertia = 1e-3;  // kg m^2, as much as 56 g at one link

struct Moved {
  DeviceVec<double> position_mm;
  DeviceVec<double> velocity;
};

Moved moved(const TipMass& mass, DeviceVec<double> force_n, double seconds,
            DeviceVec<double> velocity = {}) {
  Moved now{{}, velocity};
  const int steps = static_cast<int>(std::lround(seconds / kStepS));
  for (int i = 0; i < steps; ++i) {
    now.position_mm = now.position_mm + now.velocity * (kStepS / 2);
    now.velocity = mass.kick(now.velocity, force_n);
    now.position_mm = now.position_mm + now.velocity * (kStepS / 2);
  }
  return now;
}

OmniParams frictionless() {
  OmniParams params;
  params.viscous_ns_per_mm = 0;
  params.coulomb_n = 0;
  return params;
}

/// A tip that is free once it is out of the inkwell: no friction, no hand, rotors of `inertia`.
OmniParams free_arm(double inertia = kInertia) {
  OmniParams params = frictionless();
  params.hand_stiffness_n_per_mm = 0;
  params.hand_damping_ns_per_mm = 0;
  params.hand_mass_kg = 0;
  params.joint_inertia_kg_m2 = {inertia, inertia, inertia};
  return params;
}

double energy_mj(const OmniModel& model, double mass_kg) {
  const auto v = model.velocity_mm_per_s();
  const auto w = model.arm().joint_rates(model.joints_rad(), v);
  return mass_kg * dot(v, v) * 1e-3 / 2 + kInertia * dot(w, w) * 1e3 / 2;
}

}  // namespace

TEST_CASE("a free mass under a constant force follows the parabola") {
  const double accel = 1000 * 0.09 / kMassKg;  // mm/s^2
  const Moved end = moved(TipMass(kMassKg, 0.0, 0.0, kStepS), {0.09, 0, 0}, 0.25);
  CHECK(end.velocity.x == doctest::Approx(accel * 0.25).epsilon(1e-10));
  CHECK(end.position_mm.x == doctest::Approx(accel * 0.25 * 0.25 / 2).epsilon(1e-10));
}

TEST_CASE(
    "with viscous friction the speed is the exact exponential, with Coulomb's it ends lower") {
  const double b = 0.002, tau = kMassKg / (1000 * b), terminal = -0.2 / b;
  const Moved end = moved(TipMass(kMassKg, b, 0.0, kStepS), {0, -0.2, 0}, 0.03);
  CHECK(end.velocity.y == doctest::Approx(terminal * (1 - std::exp(-0.03 / tau))).epsilon(1e-9));
  const double position = terminal * (0.03 - tau * (1 - std::exp(-0.03 / tau)));
  CHECK(end.position_mm.y == doctest::Approx(position).epsilon(1e-5));
  const Moved rubbed = moved(TipMass(kMassKg, b, 0.1, kStepS), {0.0, 0.3, 0.0}, 1.0);
  CHECK(rubbed.velocity.y == doctest::Approx((0.3 - 0.1) / b).epsilon(1e-9));
}

TEST_CASE("Coulomb friction holds every bit below its limit, and stops a mass by its energy") {
  const TipMass sticky(kMassKg, 0.0005, 0.1, kStepS);
  CHECK(moved(sticky, {0.0577, 0.0577, 0.0577}, 0.1).position_mm ==
        DeviceVec<double>{});                                       // 0.0999 N
  CHECK(moved(sticky, {0.06, 0.06, 0.06}, 0.1).position_mm.x > 0);  // 0.104 N
  // m v^2 / 2 = F d: 0.045 kg, 0.1 m/s, 0.1 N -> 2.25 mm in 45 ms.
  const TipMass mass(kMassKg, 0.0, 0.1, kStepS);
  const Moved stopped = moved(mass, {}, 0.0451, {100, 0, 0});
  CHECK(stopped.position_mm.x == doctest::Approx(2.25).epsilon(1e-4));
  CHECK(stopped.velocity == DeviceVec<double>{});
  CHECK(moved(mass, {}, 0.0449, {100, 0, 0}).velocity.x > 0);
}

namespace {

/// Returns true if a small swing about a sampled wall of the emulator's mass grows: backward
/// difference, the force held over a period of 1 ms, `delay` whole periods late.
bool grows(double stiffness, double damping, double viscous, std::size_t delay) {
  constexpr int kSteps = 32, kTicks = 1500;
  const TipMass mass(kMassKg, viscous, 0, kStepS);
  std::array<double, 8> held_n{};
  double position_mm = 1e-3, last_mm = position_mm;
  DeviceVec<double> velocity;
  double largest[2] = {};
  for (int tick = 0; tick < kTicks; ++tick) {
    const auto now = static_cast<std::size_t>(tick) % held_n.size();
    held_n[now] = -stiffness * position_mm - damping * (position_mm - last_mm) * 1000;
    last_mm = position_mm;
    const double force_n = held_n[(now + held_n.size() - delay) % held_n.size()];
    for (int i = 0; i < kSteps; ++i) {
      position_mm += velocity.x * (kStepS / 2);
      velocity = mass.kick(velocity, {force_n, 0, 0});
      position_mm += velocity.x * (kStepS / 2);
    }
    double& of_half = largest[tick < kTicks / 2 ? 0 : 1];
    of_half = std::max(of_half, std::abs(position_mm));
    if (std::abs(position_mm) > 1e6) return true;
  }
  return largest[1] > largest[0];
}

}  // namespace

TEST_CASE("S9: the emulator's mass has the exact boundary of a sampled wall within 2 %") {
  for (const std::size_t delay : {0u, 1u, 2u, 3u}) {
    for (const double damping : {0.0005, 0.002, 0.005, 0.01}) {
      CAPTURE(delay);
      CAPTURE(damping);
      kerf::SampledLoop loop;
      loop.mass_kg = kMassKg;
      loop.viscous_ns_per_mm = 0.0002;
      loop.delay_s = 0.001 * static_cast<double>(delay);
      const double exact = kerf::highest_stiffness(loop, damping);
      CHECK_FALSE(grows(0.98 * exact, damping, 0.0002, delay));
      CHECK(grows(1.02 * exact, damping, 0.0002, delay));
    }
  }
}

TEST_CASE("a free tip accelerates as force over mass") {
  OmniModel model(free_arm(0));
  push(model, {0, 200, 0});
  const auto start = model.tip_mm();
  const int cycles = kSecond / 200;  // 5 ms: the arm hardly turns
  run(model, at({}), cycles);
  const double t = 0.005;
  const auto expected = model.motor_force_n() * (1000 / 0.045 * t * t / 2);
  const auto moved = model.tip_mm() - start;
  CHECK(norm(moved) > 0.1);
  CHECK(norm(moved - expected) < 0.01 * norm(expected));
}

TEST_CASE("hand spring and tip mass oscillate with their period and lose nothing") {
  OmniParams params = frictionless();
  params.hand_damping_ns_per_mm = 0;
  OmniModel model(params);
  const auto target = model.dock_tip_mm() + DeviceVec<double>{0, 10, 0};
  int crossings = 0;
  double first_s = 0;
  double last_s = 0;
  double highest = 0;
  double before = -10;
  for (int i = 1; i <= 10 * kSecond; ++i) {
    model.step(at(target));
    const double now = model.tip_mm().y - target.y;
    if (before < 0 && now >= 0) {
      last_s = (i - now / (now - before)) / kSecond;
      if (crossings++ == 0) first_s = last_s;
    }
    if (i > 9 * kSecond) highest = std::max(highest, now);
    before = now;
  }
  const double period = 2 * kerf::omni::kPi * std::sqrt(0.145 / 500.0);
  CHECK((last_s - first_s) / (crossings - 1) == doctest::Approx(period).epsilon(1e-4));
  CHECK(highest == doctest::Approx(10.0).epsilon(1e-3));
}

TEST_CASE("the hand gives way by force over stiffness") {
  OmniModel model(frictionless());
  const DeviceVec<double> target{3, -2, 5};
  run(model, at(target), 2 * kSecond);
  CHECK(norm(model.tip_mm() - target) < 1e-6);
  push(model, {150, -300, 220});
  run(model, at(target), 3 * kSecond);
  CHECK(norm(model.velocity_mm_per_s()) < 1e-6);
  CHECK(norm(model.motor_force_n()) > 0.5);
  CHECK(norm((model.tip_mm() - target) * 0.5 - model.motor_force_n()) < 1e-6);
}

TEST_CASE("output delay counts bus cycles and the current loop is a first-order lag") {
  OmniParams params;
  params.output_delay_cycles = 3;
  OmniModel delayed(params);
  push(delayed, {0, 100, 0});
  run(delayed, {}, 3);
  CHECK(norm(delayed.motor_force_n()) == 0);
  run(delayed, {}, 1);
  const double full = norm(delayed.motor_force_n());
  CHECK(full > 0);

  OmniParams lagging;
  lagging.current_lag_s = 0.001;
  OmniModel lag(lagging);
  push(lag, {0, 100, 0});
  run(lag, {}, 8);
  CHECK(norm(lag.motor_force_n()) == doctest::Approx(full * (1 - std::exp(-1.0))).epsilon(1e-9));
}

TEST_CASE("input delay counts bus cycles: a report has older encoder values") {
  OmniParams params;
  params.input_delay_cycles = 5;
  OmniModel delayed(params), prompt;
  std::vector<std::array<std::uint16_t, 3>> reported, was;
  for (int cycle = 0; cycle < 400; ++cycle) {
    for (OmniModel* model : {&delayed, &prompt}) {
      model->step(at({0, 5 + 0.05 * cycle, 0}));
      const auto& encoder = model->next_report().encoder;
      auto& list = model == &delayed ? reported : was;
      list.push_back({static_cast<std::uint16_t>(encoder[0]),
                      static_cast<std::uint16_t>(encoder[1]),
                      static_cast<std::uint16_t>(encoder[2])});
    }
  }
  CHECK(was.front() != was.back());
  for (std::size_t i = 5; i < reported.size(); ++i) CHECK(reported[i] == was[i - 5]);
  for (std::size_t i = 0; i < 5; ++i) CHECK(reported[i] == reported[0]);
}

TEST_CASE("rigid rotors add J^-T I J^-1 to the tip's mass") {
  OmniModel model(free_arm());
  push(model, {200, 200, 200});
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
  CHECK(norm(v * (0.045 / 1000)) < 0.8 * norm(impulse));  // the rotors carry the rest
}

TEST_CASE("a coasting arm with rigid rotors keeps its energy and gains none") {
  OmniModel model(free_arm());
  push(model, {60, 60, 60});
  run(model, at({}), kSecond / 10);
  push(model, {0, 0, 0});
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
  push(model, {2000, 2000, 2000});
  run(model, {}, kSecond / 80);  // a quarter of a period
  push(model, {0, 0, 0});
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
    push(*model, {60, 60, 60});
    run(*model, at({}), kSecond / 10);
  }
  const auto moved = rigid.tip_mm() - rigid.dock_tip_mm();
  CHECK(norm(moved) > 3);
  CHECK(norm(stiff.tip_mm() - rigid.tip_mm()) < 0.03 * norm(moved));
}

}  // namespace kerf::plant_test
