// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>

namespace kerf::zwidth {

/// What a run has shown, by two rules.
struct Swing {
  /// The tip's travel in the last third is above three encoder steps, and at least 0.97 of that in
  /// the middle third: it does not die out.
  bool swings = false;
  /// The wall gives energy in the last third, more than a push over three encoder steps takes, and
  /// at least 0.94 (0.97 squared) of what it gave in the middle third.
  bool active = false;
  double travel_mm = 0;  ///< in the last third
  double given_mj = 0;  ///< by the motors to tip and hand: what the most rises by in the last third
  double port_minimum_mj = 0;  ///< lowest energy of the device port in a run that begins at 0

  /// The worse of two runs.
  void join(const Swing& other) noexcept {
    swings = swings || other.swings;
    active = active || other.active;
    travel_mm = std::max(travel_mm, other.travel_mm);
    given_mj = std::max(given_mj, other.given_mj);
    port_minimum_mj = std::min(port_minimum_mj, other.port_minimum_mj);
  }
};

/// One tick of a run, for a phase portrait: how far the tip is out of the wall, and how fast it
/// leaves, along the normal.
struct SwingTick {
  double tip_mm, mm_per_s;
};
/// Called with each tick; may be empty.
using SwingWatch = std::function<void(const SwingTick&)>;

/// Follows one run of a known number of ticks.
class SwingMeter {
 public:
  static constexpr double kGoesOn = 0.97;  ///< travel of a third over that of the one before

  SwingMeter(std::int64_t ticks, double step_mm, double push_n) noexcept
      : ticks_(ticks), least_mm_(std::max(3 * step_mm, kLeastMm)), least_mj_(least_mm_ * push_n) {}

  /// Once per tick: where the tip is, and what the motors have given since the start (N mm).
  void take(double tip_mm, double given_mj) noexcept {
    const auto third = static_cast<std::size_t>(std::min<std::int64_t>(2, tick_ * 3 / ticks_));
    Third& now = thirds_[third];
    now.lowest_mm = std::min(now.lowest_mm, tip_mm);
    now.highest_mm = std::max(now.highest_mm, tip_mm);
    now.given_mj = std::max(now.given_mj, given_mj);
    if (tick_ == 0) first_given_mj_ = given_mj;
    port_minimum_mj_ = std::min(port_minimum_mj_, first_given_mj_ - given_mj);
    ++tick_;
  }

  /// Of a run that has come to rest before its end.
  [[nodiscard]] Swing rest() const noexcept { return {.port_minimum_mj = port_minimum_mj_}; }

  [[nodiscard]] Swing swing() const noexcept {
    const double before = travel(thirds_[1]), last = travel(thirds_[2]);
    const double gave = thirds_[1].given_mj - thirds_[0].given_mj;
    Swing swing = rest();
    swing.travel_mm = last;
    swing.given_mj = thirds_[2].given_mj - thirds_[1].given_mj;
    swing.swings = last > least_mm_ && last >= kGoesOn * before;
    swing.active = swing.given_mj > least_mj_ && swing.given_mj >= kGoesOn * kGoesOn * gave;
    return swing;
  }

 private:
  /// Below what any encoder shows: where a loop without encoder steps counts as at rest.
  static constexpr double kLeastMm = 1e-4;

  struct Third {
    double lowest_mm = std::numeric_limits<double>::infinity();
    double highest_mm = -std::numeric_limits<double>::infinity();
    double given_mj = -std::numeric_limits<double>::infinity();
  };
  static double travel(const Third& third) noexcept {
    return std::max(0.0, third.highest_mm - third.lowest_mm);
  }

  std::int64_t ticks_;
  double least_mm_, least_mj_;
  std::int64_t tick_ = 0;
  std::array<Third, 3> thirds_{};
  double first_given_mj_ = 0, port_minimum_mj_ = 0;
};

}  // namespace kerf::zwidth
