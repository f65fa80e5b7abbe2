// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "controller/stability/one_axis_plant.hpp"
#include "controller/stability/sampled_loop.hpp"

namespace kerf {

/// One axis of a device and the hand that holds it as a host sees it, period by period: the plant
/// with the encoder and the delay of its `SampledLoop`. mm, N, s. Never allocates.
class OneAxis {
 public:
  /// The encoder's steps lie `shift_mm` before the multiples of its quantum.
  explicit OneAxis(const SampledLoop& loop, double shift_mm = 0)
      : whole_(whole_of(loop)),
        part_(delay_of(loop) - static_cast<double>(whole_)),
        quantum_mm_(loop.quantum_mm),
        shift_mm_(shift_mm),
        period_s_(loop.period_s),
        plant_(loop, part_, 1 - part_) {}

  /// Before the first period.
  void start(double place_mm, double mm_per_s = 0) noexcept {
    plant_.place(place_mm, mm_per_s * period_s_);
  }

  [[nodiscard]] double place_mm() const noexcept { return plant_.tip_mm(); }
  [[nodiscard]] double mm_per_s() const noexcept { return plant_.mm_per_period() / period_s_; }
  /// Held by friction at the end of the last period.
  [[nodiscard]] bool stuck() const noexcept { return plant_.stuck(); }
  /// Of the motors, at the end of the last period.
  [[nodiscard]] double motor_n() const noexcept { return asked(whole_); }
  /// The place as the encoder shows it: the quantum's lower end; exact without a quantum.
  [[nodiscard]] double encoder_mm() const noexcept {
    if (!(quantum_mm_ > 0)) return place_mm();
    return std::floor((place_mm() + shift_mm_) / quantum_mm_) * quantum_mm_ - shift_mm_;
  }
  /// Work of the motors on hand and device since the start, N mm = mJ, by the true motion. Rises
  /// for good: the loop is active.
  [[nodiscard]] double motor_work_mj() const noexcept { return work_mj_; }

  /// One period, at whose beginning the encoder was read: `force_n` of the motors comes of that
  /// reading and acts after the delay; `push_n` is the hand's, from now on.
  void tick(double force_n, double push_n) noexcept {
    head_ = (head_ + 1) % asked_n_.size();
    asked_n_[head_] = force_n;
    if (part_ > 0) stretch(0, asked(whole_ + 1), push_n);
    stretch(1, asked(whole_), push_n);
  }

 private:
  /// In periods; a part that is rounding alone is none.
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

/// The wall of a `SampledLoop`, at place 0 and solid above: F = -(K x + B v) of the encoder's place
/// and its filtered backward difference, never a pull.
class SampledWall {
 public:
  SampledWall(const SampledLoop& loop, double stiffness_n_per_mm, double damping_ns_per_mm) noexcept
      : stiffness_(stiffness_n_per_mm),
        damping_(damping_ns_per_mm),
        period_s_(loop.period_s),
        share_(loop.period_s / (loop.period_s + loop.velocity_filter_s)) {}

  /// At rest at this place.
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

}  // namespace kerf
