// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <doctest/doctest.h>

#include "hil/devmodel/arm_plant.hpp"

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
