// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "controller/stability/limit_cycle.hpp"
#include "controller/stability/sampled_loop.hpp"
#include "shared/numeric/linear_algebra.hpp"

// Exact simulation of one axis: device and hand under a held force, with Coulomb friction, encoder
// and delay; and a hand that pushes on a wall.

namespace kerf {

/// Response of device and hand of a loop (mass, viscous friction, hand; no Coulomb friction) while
/// a force is held: position (mm) and speed (mm per period) after a while, from those before
/// (`free`) and from 1 N (`driven`). Exact to the last digits: by the matrix exponential, without
/// libm.
struct HoldResponse {
  std::array<std::array<double, 2>, 2> free{};
  std::array<double, 2> driven{};
};

/// After `periods` >= 0 of the loop.
[[nodiscard]] inline HoldResponse held_mass(const SampledLoop& loop, double periods) {
  constexpr double kMmPerM = 1000;
  const double per_n = kMmPerM * loop.period_s * loop.period_s / (loop.mass_kg + loop.hand.mass_kg);
  const double spring = loop.hand.stiffness_n_per_mm * per_n;
  const double damper =
      (loop.viscous_ns_per_mm + loop.hand.damping_ns_per_mm) * per_n / loop.period_s;
  // exp of the 3 x 3 generator of (place, speed, force): Taylor for a short time, then squared.
  using vec3::Matrix;
  const auto times = [](const Matrix& a, const Matrix& b) {
    Matrix c{};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        for (std::size_t k = 0; k < 3; ++k) c[i][j] += a[i][k] * b[k][j];
      }
    }
    return c;
  };
  double step = periods;
  int halvings = 0;
  for (; (1 + spring + damper + per_n) * step > 0.25; step /= 2) ++halvings;
  const Matrix generator{{{0, step, 0}, {-spring * step, -damper * step, per_n * step}, {0, 0, 0}}};
  const Matrix one{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Matrix whole = one;
  constexpr int kTerms = 14;  // 0.25^14 / 14! < 1e-19
  for (int n = kTerms; n > 0; --n) {
    whole = times(generator, whole);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) whole[i][j] = one[i][j] + whole[i][j] / n;
    }
  }
  for (int i = 0; i < halvings; ++i) whole = times(whole, whole);
  return {{{{whole[0][0], whole[0][1]}, {whole[1][0], whole[1][1]}}}, {whole[0][2], whole[1][2]}};
}

/// One axis of a device with its hand, under a force that is held: exact, with Coulomb friction.
///
/// While the tip keeps its direction friction is one more held force, so a stretch is one product
/// with a 2 x 2 matrix. If the tip reverses within a stretch the moment is found by bisection, to
/// 2^-30 of the stretch; there it sticks or goes back. No libm, so the same bits on every machine.
class OneAxisPlant {
 public:
  /// A stretch is a part of the loop's period, in periods.
  OneAxisPlant(const SampledLoop& loop, double first_stretch, double second_stretch)
      : stretches_{levels(loop, first_stretch), levels(loop, second_stretch)},
        coulomb_n_(loop.coulomb_n),
        spring_n_per_mm_(loop.hand.stiffness_n_per_mm) {}

  void place(double tip_mm, double mm_per_period) noexcept {
    tip_mm_ = tip_mm;
    speed_ = mm_per_period;
  }
  [[nodiscard]] double tip_mm() const noexcept { return tip_mm_; }
  [[nodiscard]] double mm_per_period() const noexcept { return speed_; }
  /// Held by friction through the whole of the last stretch.
  [[nodiscard]] bool stuck() const noexcept { return stuck_; }

  /// Advances by stretch `s` under `force_n` of motor and hand, without the hand's spring.
  void advance(std::size_t s, double force_n) noexcept {
    const Levels& level = stretches_[s];
    if (coulomb_n_ == 0) {
      take(level[0], force_n);
      return;
    }
    double side = 0;
    stuck_ = !start(force_n, side);
    if (stuck_) return;
    const double tip_mm = tip_mm_, speed = speed_;
    take(level[0], force_n - side * coulomb_n_);
    if (speed_ * side >= 0) return;
    tip_mm_ = tip_mm;
    speed_ = speed;
    turn_within(level, force_n, side);
  }

 private:
  static constexpr std::size_t kHalvings = 30;
  using Levels = std::array<HoldResponse, kHalvings + 1>;  ///< of a stretch over 2^level

  static Levels levels(const SampledLoop& loop, double periods) {
    Levels out;
    for (std::size_t j = 0; j < out.size(); ++j) {
      out[j] = held_mass(loop, std::ldexp(periods, -static_cast<int>(j)));
    }
    return out;
  }

  void take(const HoldResponse& by, double force_n) noexcept {
    const double tip_mm = tip_mm_;
    tip_mm_ = by.free[0][0] * tip_mm + by.free[0][1] * speed_ + by.driven[0] * force_n;
    speed_ = by.free[1][0] * tip_mm + by.free[1][1] * speed_ + by.driven[1] * force_n;
  }

  /// Sets the side to which the tip goes on; false if friction holds it.
  bool start(double force_n, double& side) const noexcept {
    if (speed_ != 0) {
      side = speed_ > 0 ? 1 : -1;
      return true;
    }
    const double drive_n = force_n - spring_n_per_mm_ * tip_mm_;
    side = drive_n > 0 ? 1 : -1;
    return std::abs(drive_n) > coulomb_n_;
  }

  void turn_within(const Levels& level, double force_n, double side) noexcept {
    std::array<bool, kHalvings + 1> left{};
    for (std::size_t j = 1; j <= kHalvings; ++j) {
      const double tip_mm = tip_mm_, speed = speed_;
      take(level[j], force_n - side * coulomb_n_);
      if (speed_ * side > 0) continue;
      tip_mm_ = tip_mm;
      speed_ = speed;
      left[j] = true;
    }
    speed_ = 0;
    if (!start(force_n, side)) return;
    for (std::size_t j = 1; j <= kHalvings; ++j) {
      if (!left[j]) continue;
      take(level[j], force_n - side * coulomb_n_);
      if (speed_ * side < 0) speed_ = 0;  // a second turn within one period
    }
  }

  std::array<Levels, 2> stretches_;
  double coulomb_n_;
  double spring_n_per_mm_;
  double tip_mm_ = 0;
  double speed_ = 0;
  bool stuck_ = false;
};

/// One axis of a device and its hand as a host reads and drives it, period by period: the plant
/// with the encoder and the delay of its `SampledLoop`. mm, N, s. Never allocates.
class AxisSimulation {
 public:
  /// The encoder's steps lie `shift_mm` before the multiples of its quantum.
  explicit AxisSimulation(const SampledLoop& loop, double shift_mm = 0)
      : whole_(whole_of(loop)),
        part_(delay_of(loop) - static_cast<double>(whole_)),
        quantum_mm_(loop.quantum_mm),
        shift_mm_(shift_mm),
        period_s_(loop.period_s),
        plant_(loop, part_, 1 - part_) {}

  /// Sets the position before the first period.
  void start(double place_mm, double mm_per_s = 0) noexcept {
    plant_.place(place_mm, mm_per_s * period_s_);
  }

  [[nodiscard]] double place_mm() const noexcept { return plant_.tip_mm(); }
  [[nodiscard]] double mm_per_s() const noexcept { return plant_.mm_per_period() / period_s_; }
  /// Held by friction at the end of the last period.
  [[nodiscard]] bool stuck() const noexcept { return plant_.stuck(); }
  /// Of the motors, at the end of the last period.
  [[nodiscard]] double motor_n() const noexcept { return asked(whole_); }
  /// The position as the encoder shows it: the quantum's lower end; exact without a quantum.
  [[nodiscard]] double encoder_mm() const noexcept {
    if (!(quantum_mm_ > 0)) return place_mm();
    return std::floor((place_mm() + shift_mm_) / quantum_mm_) * quantum_mm_ - shift_mm_;
  }
  /// Work of the motors on hand and device since the start, N mm = mJ, by the true motion. If it
  /// keeps rising the loop is active.
  [[nodiscard]] double motor_work_mj() const noexcept { return work_mj_; }

  /// One period, at whose beginning the encoder was read: `force_n` of the motors is the answer to
  /// that reading and acts after the delay; `push_n` is that of the hand, from now on.
  void tick(double force_n, double push_n) noexcept {
    head_ = (head_ + 1) % asked_n_.size();
    asked_n_[head_] = force_n;
    if (part_ > 0) stretch(0, asked(whole_ + 1), push_n);
    stretch(1, asked(whole_), push_n);
  }

 private:
  /// In periods; a part from rounding alone is dropped.
  static double delay_of(const SampledLoop& loop) noexcept {
    const double periods = std::min(loop.delay_s / loop.period_s, kMaxDelayPeriods);
    const double whole = std::round(periods);
    return std::abs(periods - whole) < 1e-9 ? whole : periods;
  }
  static std::size_t whole_of(const SampledLoop& loop) noexcept {
    return static_cast<std::size_t>(delay_of(loop));
  }
  [[nodiscard]] double asked(std::size_t ticks_ago) const noexcept {
    return asked_n_[(head_ + asked_n_.size() - ticks_ago) % asked_n_.size()];
  }
  void stretch(std::size_t which, double motor_n, double push_n) noexcept {
    const double from_mm = place_mm();
    plant_.advance(which, motor_n + push_n);
    work_mj_ += motor_n * (place_mm() - from_mm);
  }

  std::size_t whole_;  ///< periods of the delay
  double part_;        ///< and the rest of it, of a period
  double quantum_mm_, shift_mm_;
  double period_s_;
  OneAxisPlant plant_;
  std::array<double, static_cast<std::size_t>(kMaxDelayPeriods) + 2> asked_n_{};  ///< ring
  std::size_t head_ = 0;
  double work_mj_ = 0;
};

/// The wall of a `SampledLoop`, at position 0 and solid above: F = -(K x + B v) of the encoder's
/// position and its filtered backward difference, never a pull.
class SampledWall {
 public:
  SampledWall(const SampledLoop& loop, double stiffness_n_per_mm, double damping_ns_per_mm) noexcept
      : stiffness_(stiffness_n_per_mm),
        damping_(damping_ns_per_mm),
        period_s_(loop.period_s),
        share_(loop.period_s / (loop.period_s + loop.velocity_filter_s)) {}

  /// At rest at this position.
  void start(double encoder_mm) noexcept {
    last_mm_ = encoder_mm;
    speed_ = 0;
  }

  [[nodiscard]] double force_n(double encoder_mm) noexcept {
    speed_ += share_ * ((encoder_mm - last_mm_) / period_s_ - speed_);
    last_mm_ = encoder_mm;
    if (encoder_mm <= 0) return 0;
    return std::min(0.0, -(stiffness_ * encoder_mm + damping_ * speed_));
  }

 private:
  double stiffness_, damping_, period_s_;
  double share_;  ///< of the newest difference: a backward Euler low-pass
  double last_mm_ = 0, speed_ = 0;
};

/// A hand that reaches a wall and keeps pushing: from rest outside, with a constant force.
struct WallContactTest {
  double from_mm = -0.1;
  double push_n = 0.5;  ///< on top of the device's Coulomb friction
  /// Limit of the run: of chaotic swings one in a hundred stops only after 3 to 45 s, and a hum may
  /// take as long to give energy (docs/stability.md).
  double seconds = 60;
};

/// Simulates the push against the sampled wall until the tip is proven to be at rest, or to the
/// limit. A tip more than 1 m away is lost: far beyond any device.
[[nodiscard]] inline LimitCycle push_on_wall(const SampledLoop& loop, double stiffness_n_per_mm,
                                             double damping_ns_per_mm,
                                             const WallContactTest& push = {}) {
  constexpr double kLostMm = 1000;
  // A backward Euler low-pass decays in so many periods and time constants to e^-40 < 2^-53.
  constexpr double kDecayed = 40;
  const double push_n = loop.coulomb_n + push.push_n;
  const auto limit = static_cast<std::int64_t>(push.seconds / loop.period_s);
  const double settled = kMaxDelayPeriods + kDecayed * (1 + loop.velocity_filter_s / loop.period_s);
  LimitCycleDetector detector(
      {.limit = limit, .first = limit / 2, .settled = static_cast<std::int64_t>(settled)},
      loop.quantum_mm, push_n);
  AxisSimulation axis(loop);
  axis.start(push.from_mm);
  SampledWall wall(loop, stiffness_n_per_mm, damping_ns_per_mm);
  wall.start(push.from_mm);
  double last_n = 0;
  while (true) {
    const double asked_n = wall.force_n(axis.encoder_mm());
    axis.tick(asked_n, push_n);
    if (!(std::abs(axis.place_mm()) < kLostMm)) return detector.lost(kLostMm, axis.motor_work_mj());
    const bool is_held = axis.stuck() && asked_n == last_n;
    last_n = asked_n;
    if (detector.take(axis.place_mm(), axis.motor_work_mj(), is_held)) return detector.verdict();
  }
}

}  // namespace kerf
