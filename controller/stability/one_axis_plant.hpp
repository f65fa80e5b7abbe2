// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "controller/stability/held_mass.hpp"
#include "controller/stability/sampled_loop.hpp"

namespace kerf {

/// One axis of a device with its hand, under a force that is held: exact, with Coulomb friction.
///
/// While the tip keeps its direction friction is one more held force, so a stretch is one product
/// with a 2 x 2 matrix. Where the tip turns round within a stretch the moment is found by halving,
/// to 2^-30 of the stretch; there it sticks or goes back. No libm, so the same bits on every
/// machine.
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

  /// The whole of stretch `s` under `force_n` of motor and hand, without the hand's spring.
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
  using Levels = std::array<HeldMass, kHalvings + 1>;  ///< of a stretch over 2^level

  static Levels levels(const SampledLoop& loop, double periods) {
    Levels out;
    for (std::size_t j = 0; j < out.size(); ++j) {
      out[j] = held_mass(loop, std::ldexp(periods, -static_cast<int>(j)));
    }
    return out;
  }

  void take(const HeldMass& by, double force_n) noexcept {
    const double tip_mm = tip_mm_;
    tip_mm_ = by.free[0][0] * tip_mm + by.free[0][1] * speed_ + by.driven[0] * force_n;
    speed_ = by.free[1][0] * tip_mm + by.free[1][1] * speed_ + by.driven[1] * force_n;
  }

  /// To which side the tip goes on; false: friction holds it.
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

}  // namespace kerf
