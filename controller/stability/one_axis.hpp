// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "controller/stability/sampled_loop.hpp"

namespace kerf {

/// One axis of a device and the hand that holds it, in time: the plant of a `SampledLoop` with its
/// Coulomb friction, its encoder and its delay, for maps of many cells and for truth beside the
/// whole servo step. mm, N, s, kg.
///
/// One period has `kSubsteps` steps. In each the force is constant, and mass, dampers and the
/// hand's spring move exactly as their differential equation says; so a loop without Coulomb
/// friction is exact, whatever the step. Coulomb friction takes off the speed what it can take in
/// one step and never turns it round (the stick band of Karnopp's model, with the width that
/// follows from the step). The delay is taken to the nearest step. Never allocates.
class OneAxis {
 public:
  static constexpr int kSubsteps = 100;  // a stick is found to 1 % of a period

  explicit OneAxis(const SampledLoop& loop) noexcept : quantum_mm_(loop.quantum_mm) {
    const double late = std::clamp(loop.delay_s / loop.period_s, 0.0, kMaxDelayPeriods) * kSubsteps;
    const auto late_steps = static_cast<std::size_t>(std::llround(late));
    whole_ = late_steps / kSubsteps;
    rest_ = static_cast<int>(late_steps % kSubsteps);
    solve(loop);
    // What friction can take off in a step, as a speed.
    drop_ = loop.coulomb_n * by_force_[1];
    coulomb_n_ = loop.coulomb_n;
  }

  /// At this place, with this speed and all motors off.
  void start(double place_mm, double speed_mm_per_s) noexcept {
    *this = cleared(place_mm, speed_mm_per_s);
  }

  [[nodiscard]] double place_mm() const noexcept { return place_; }
  [[nodiscard]] double speed_mm_per_s() const noexcept { return speed_; }
  /// The place as the encoder shows it: the quantum's lower end; exact without a quantum.
  [[nodiscard]] double encoder_mm() const noexcept {
    return quantum_mm_ > 0 ? std::floor(place_ / quantum_mm_) * quantum_mm_ : place_;
  }
  /// Work of the motors on hand and device since the start, N mm = mJ, by the true motion. Above
  /// zero for good: the loop is active.
  [[nodiscard]] double motor_work_mj() const noexcept { return work_mj_; }

  /// One period, at whose beginning the encoder was read: `force_n` of the motors comes of that
  /// reading and acts after the delay; `push_n` is the hand's, from now on.
  void tick(double force_n, double push_n) noexcept {
    head_ = (head_ + 1) % asked_n_.size();
    asked_n_[head_] = force_n;
    const double now_n = asked(whole_);
    const double before_n = asked(whole_ + 1);
    for (int i = 0; i < kSubsteps; ++i) step(i < rest_ ? before_n : now_n, push_n);
  }

 private:
  /// m x'' = F - b x' - k x over one step, by the series of its matrix exponential.
  void solve(const SampledLoop& loop) noexcept {
    constexpr double kMmPerM = 1000;
    const double step_s = loop.period_s / kSubsteps;
    const double per_n = kMmPerM / (loop.mass_kg + loop.hand.mass_kg);
    const double damper = (loop.viscous_ns_per_mm + loop.hand.damping_ns_per_mm) * per_n;
    const double spring = loop.hand.stiffness_n_per_mm * per_n;
    // Columns: a unit of place, of speed, of force. A term is the one before, once derived.
    const auto column = [&](double place, double speed, double force) {
      std::array<double, 2> sum{place, speed};
      // A step is short: the largest damper and spring of any map make terms below 1, and the
      // terms fall with n!.
      constexpr int kTerms = 24;
      for (int n = 1; n <= kTerms; ++n) {
        const double h = step_s / n;
        const double faster = (force * per_n - damper * speed - spring * place) * h;
        place = speed * h;
        speed = faster;
        force = 0;
        sum[0] += place;
        sum[1] += speed;
      }
      return sum;
    };
    by_place_ = column(1, 0, 0);
    by_speed_ = column(0, 1, 0);
    by_force_ = column(0, 0, 1);
    half_step_s_ = step_s / 2;
  }

  [[nodiscard]] OneAxis cleared(double place_mm, double speed_mm_per_s) const noexcept {
    OneAxis fresh = *this;
    fresh.asked_n_.fill(0);
    fresh.place_ = place_mm;
    fresh.speed_ = speed_mm_per_s;
    fresh.work_mj_ = 0;
    return fresh;
  }

  [[nodiscard]] double asked(std::size_t ticks_ago) const noexcept {
    return asked_n_[(head_ + asked_n_.size() - ticks_ago) % asked_n_.size()];
  }

  void step(double motor_n, double push_n) noexcept {
    const double from = place_;
    const double pushed_n = motor_n + push_n;
    const double free = by_place_[1] * place_ + by_speed_[1] * speed_ + by_force_[1] * pushed_n;
    if (std::abs(free) <= drop_) {
      place_ += speed_ * half_step_s_;  // to rest, at an even rate
      speed_ = 0;
    } else {
      const double net_n = pushed_n - std::copysign(coulomb_n_, free);
      place_ = by_place_[0] * place_ + by_speed_[0] * speed_ + by_force_[0] * net_n;
      speed_ = free - std::copysign(drop_, free);
    }
    work_mj_ += motor_n * (place_ - from);
  }

  std::array<double, 2> by_place_{}, by_speed_{}, by_force_{};  ///< place and speed after a step
  double half_step_s_ = 0;
  double coulomb_n_ = 0;
  double drop_ = 0;  ///< mm/s
  double quantum_mm_ = 0;
  std::size_t whole_ = 0;  ///< delay: periods ...
  int rest_ = 0;           ///< ... and steps
  std::array<double, static_cast<std::size_t>(kMaxDelayPeriods) + 2> asked_n_{};  ///< ring
  std::size_t head_ = 0;
  double place_ = 0, speed_ = 0;
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
