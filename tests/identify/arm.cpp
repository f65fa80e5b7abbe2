// SPDX-License-Identifier: Apache-2.0
// The hidden truth of the identification's tests: arms whose values the estimator never gets. Its
// equations are solved otherwise than the estimator's: friction as impulses that stop an axis if
// they can (Moreau's time stepping), 1/20 of a tick a step, a static friction above the sliding
// one (Stribeck), a second mass on a spring behind the encoders. Called by ctypes; SI units.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace {

constexpr int kSteps = 20;  // of a tick
constexpr int kRing = 16;   // ticks of delay
constexpr std::size_t kAxes = 3;
using Vector = std::array<double, kAxes>;

struct Arm {
  double mass[3][3];     // of the whole arm at the tip
  double inverse[3][3];  // of the part before the spring: mass * motor_ratio
  double viscous[3], coulomb[3], weight[3];
  double static_ratio, stribeck_m_per_s;
  double quantum[3], shift[3];
  double delay;           // periods
  double mode_rad_per_s;  // free arm; 0: rigid
  double motor_ratio, damping_ratio;
  double place[3], speed[3], behind[3], behind_speed[3];
  double asked[kRing][3];
  double impulse[3];
  std::int64_t tick;
};

Vector times(const double (&m)[3][3], const Vector& v) {
  Vector out{};
  for (std::size_t i = 0; i < kAxes; ++i) {
    for (std::size_t j = 0; j < kAxes; ++j) out[i] += m[i][j] * v[j];
  }
  return out;
}

/// Mean force of the step from `from` to `to`, in parts of the tick.
Vector acting(const Arm& arm, double from, double to) {
  Vector mean{};
  const double whole = std::floor(arm.delay), part = arm.delay - whole;
  const double old = std::clamp((part - from) / (to - from), 0.0, 1.0);
  const auto at = [&](double ticks) {
    return static_cast<std::size_t>(
        ((arm.tick - static_cast<std::int64_t>(ticks)) % kRing + kRing) % kRing);
  };
  for (std::size_t i = 0; i < kAxes; ++i) {
    mean[i] = old * arm.asked[at(whole + 1)][i] + (1 - old) * arm.asked[at(whole)][i];
  }
  return mean;
}

/// The speed after impulses of friction, each at most `most`, that stop their axis if they can.
void rub(Arm& arm, Vector& speed, const Vector& most) {
  const Vector free = speed;
  double(&p)[3] = arm.impulse;
  constexpr int kRounds = 60;
  for (int round = 0; round < kRounds; ++round) {
    double change = 0;
    for (std::size_t i = 0; i < kAxes; ++i) {
      double v = free[i];
      for (std::size_t j = 0; j < kAxes; ++j) v -= arm.inverse[i][j] * p[j];
      const double next = std::clamp(p[i] + v / arm.inverse[i][i], -most[i], most[i]);
      change = std::max(change, std::abs(next - p[i]) / (most[i] + 1e-300));
      p[i] = next;
    }
    if (change < 1e-9) break;
  }
  const Vector lost = times(arm.inverse, {p[0], p[1], p[2]});
  for (std::size_t i = 0; i < kAxes; ++i) speed[i] = free[i] - lost[i];
}

/// Half a drift, a kick, half a drift: of second order in h, and a swing keeps its energy.
void step(Arm& arm, const Vector& force, double h) {
  const double w = arm.mode_rad_per_s, reduced = arm.motor_ratio * (1 - arm.motor_ratio);
  Vector net = force, most{};
  for (std::size_t i = 0; i < kAxes; ++i) {
    arm.place[i] += h / 2 * arm.speed[i];
    arm.behind[i] += h / 2 * arm.behind_speed[i];
  }
  if (w > 0) {
    Vector twist{};
    for (std::size_t i = 0; i < kAxes; ++i) {
      twist[i] = w * w * (arm.place[i] - arm.behind[i]) +
                 2 * arm.damping_ratio * w * (arm.speed[i] - arm.behind_speed[i]);
      arm.behind_speed[i] += h * arm.motor_ratio * twist[i];
    }
    const Vector spring = times(arm.mass, twist);
    for (std::size_t i = 0; i < kAxes; ++i) net[i] -= reduced * spring[i];
  }
  for (std::size_t i = 0; i < kAxes; ++i) {
    net[i] -= arm.weight[i];
    const double slow = arm.speed[i] / arm.stribeck_m_per_s;
    most[i] = h * arm.coulomb[i] * (1 + (arm.static_ratio - 1) * std::exp(-slow * slow));
  }
  // Viscous friction by the mean speed of the step.
  const Vector before{arm.speed[0], arm.speed[1], arm.speed[2]};
  Vector speed = before;
  for (int pass = 0; pass < 2; ++pass) {
    Vector dragged = net;
    for (std::size_t i = 0; i < kAxes; ++i) {
      dragged[i] -= arm.viscous[i] * (before[i] + speed[i]) / 2;
    }
    const Vector gain = times(arm.inverse, dragged);
    for (std::size_t i = 0; i < kAxes; ++i) speed[i] = before[i] + h * gain[i];
    rub(arm, speed, most);
  }
  for (std::size_t i = 0; i < kAxes; ++i) {
    arm.speed[i] = speed[i];
    arm.place[i] += h / 2 * speed[i];
    arm.behind[i] += h / 2 * arm.behind_speed[i];
  }
}

}  // namespace

extern "C" {

std::size_t arm_bytes() {
  return sizeof(Arm);
}

/// One tick of `count` arms: `force` is asked for now; `shown` is what the encoders show at its
/// end.
void arms_tick(Arm* arms, int count, const double* force, double period_s, double* shown) {
  for (int n = 0; n < count; ++n) {
    Arm& arm = arms[n];
    const auto slot = static_cast<std::size_t>(arm.tick % kRing);
    std::copy_n(force + 3 * n, 3, arm.asked[slot]);
    for (int i = 0; i < kSteps; ++i) {
      const double from = double(i) / kSteps, to = double(i + 1) / kSteps;
      step(arm, acting(arm, from, to), period_s / kSteps);
    }
    ++arm.tick;
    for (std::size_t i = 0; i < kAxes; ++i) {
      const double q = arm.quantum[i];
      shown[3 * n + static_cast<int>(i)] =
          q > 0 ? std::floor((arm.place[i] + arm.shift[i]) / q) * q : arm.place[i];
    }
  }
}
}
