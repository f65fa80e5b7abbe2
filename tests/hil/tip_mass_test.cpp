// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <doctest/doctest.h>

#include "controller/stability/gain_limits.hpp"
#include "hil/device/plant.hpp"

namespace {

using kerf::DeviceVec;
using kerf::TipMass;

constexpr double kStepS = 1.0 / 32000;
constexpr double kMassKg = 0.045;

struct Run {
  DeviceVec<double> position_mm;
  DeviceVec<double> velocity;
};

Run run(const TipMass& mass, DeviceVec<double> force_n, double seconds) {
  Run now;
  const int steps = static_cast<int>(std::lround(seconds / kStepS));
  for (int i = 0; i < steps; ++i) {
    now.position_mm = now.position_mm + now.velocity * (kStepS / 2);
    now.velocity = mass.kick(now.velocity, force_n);
    now.position_mm = now.position_mm + now.velocity * (kStepS / 2);
  }
  return now;
}

}  // namespace

TEST_CASE("a free mass under a constant force follows the parabola") {
  const TipMass mass(kMassKg, 0.0, 0.0, kStepS);
  const double accel = 1000 * 0.09 / kMassKg;  // mm/s^2
  const Run end = run(mass, {0.09, 0, 0}, 0.25);
  CHECK(end.velocity.x == doctest::Approx(accel * 0.25).epsilon(1e-10));
  CHECK(end.position_mm.x == doctest::Approx(accel * 0.25 * 0.25 / 2).epsilon(1e-10));
}

TEST_CASE("with viscous friction the speed is the exact exponential") {
  const double b = 0.002;
  const TipMass mass(kMassKg, b, 0.0, kStepS);
  const double tau = kMassKg / (1000 * b);
  const Run end = run(mass, {0, -0.2, 0}, 0.03);
  const double terminal = -0.2 / b;
  CHECK(end.velocity.y == doctest::Approx(terminal * (1 - std::exp(-0.03 / tau))).epsilon(1e-9));
  const double position = terminal * (0.03 - tau * (1 - std::exp(-0.03 / tau)));
  CHECK(end.position_mm.y == doctest::Approx(position).epsilon(1e-5));
}

TEST_CASE("below the Coulomb limit nothing moves, not by one bit") {
  const TipMass mass(kMassKg, 0.0005, 0.1, kStepS);
  const Run end = run(mass, {0.0577, 0.0577, 0.0577}, 0.1);  // 0.0999 N
  CHECK(end.position_mm == DeviceVec<double>{});
  const Run moving = run(mass, {0.06, 0.06, 0.06}, 0.1);  // 0.104 N
  CHECK(moving.position_mm.x > 0);
}

TEST_CASE("the terminal speed is the force above friction over the viscous coefficient") {
  const double b = 0.002;
  const TipMass mass(kMassKg, b, 0.1, kStepS);
  const Run end = run(mass, {0.0, 0.3, 0.0}, 1.0);
  CHECK(end.velocity.y == doctest::Approx((0.3 - 0.1) / b).epsilon(1e-9));
}

TEST_CASE("Coulomb friction stops a moving mass after the distance of its energy") {
  const TipMass mass(kMassKg, 0.0, 0.1, kStepS);
  DeviceVec<double> velocity{100, 0, 0};
  double travelled = 0;
  int steps = 0;
  for (; norm(velocity) > 0 && steps < 100'000; ++steps) {
    travelled += velocity.x * kStepS / 2;
    velocity = mass.kick(velocity, {});
    travelled += velocity.x * kStepS / 2;
  }
  // m v^2 / 2 = F d: 0.045 kg, 0.1 m/s, 0.1 N -> 2.25 mm in 45 ms.
  CHECK(travelled == doctest::Approx(2.25).epsilon(1e-4));
  CHECK(steps * kStepS == doctest::Approx(0.045).epsilon(1e-3));
}

namespace {

/// Whether a small swing about a sampled wall of the emulator's mass grows: backward difference,
/// the force held over a period of 1 ms, `delay` whole periods late.
bool grows(double stiffness, double damping, double viscous, std::size_t delay) {
  constexpr int kSteps = 32, kTicks = 1500;
  const TipMass mass(kMassKg, viscous, 0, kStepS);
  std::array<double, 8> held_n{};
  double place_mm = 1e-3, last_mm = place_mm;
  DeviceVec<double> velocity;
  double largest[2] = {};
  for (int tick = 0; tick < kTicks; ++tick) {
    const auto now = static_cast<std::size_t>(tick) % held_n.size();
    held_n[now] = -stiffness * place_mm - damping * (place_mm - last_mm) * 1000;
    last_mm = place_mm;
    const double force_n = held_n[(now + held_n.size() - delay) % held_n.size()];
    for (int i = 0; i < kSteps; ++i) {
      place_mm += velocity.x * (kStepS / 2);
      velocity = mass.kick(velocity, {force_n, 0, 0});
      place_mm += velocity.x * (kStepS / 2);
    }
    double& of_half = largest[tick < kTicks / 2 ? 0 : 1];
    of_half = std::max(of_half, std::abs(place_mm));
    if (std::abs(place_mm) > 1e6) return true;
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
