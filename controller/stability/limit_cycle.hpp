// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "include/kerf/stability.hpp"

namespace kerf {

/// Follows one run until its verdict is final. Rest is only reported if it is proven:
///
/// * the tip is held by friction under a constant force for longer than the loop remembers: a fixed
///   point;
/// * or travel and energy of the last half of the run are within one encoder step. A loop with an
///   encoder can be quiet for long and then burst, so that counts at the limit alone. A loop
///   without encoder steps ends as soon as it holds for the half of a shorter run, of the limit
///   over a power of two: there it is so small that the loop is linear.
///
/// Any other run is followed to the limit. The verdict depends on the limit alone.
class LimitCycleDetector {
 public:
  struct Ticks {
    std::int64_t limit;    ///< of the run
    std::int64_t first;    ///< of the shortest run that counts, some periods of the loop
    std::int64_t settled;  ///< held for so long: no earlier motion has an effect any more
  };

  LimitCycleDetector(const Ticks& ticks, double step_mm, double push_n) noexcept
      : limit_(std::max<std::int64_t>(1, ticks.limit)),
        settled_(ticks.settled),
        smooth_(!(step_mm > 0)),
        most_mm_(smooth_ ? kSmoothMm : step_mm),
        most_mj_(most_mm_ * push_n) {
    while ((limit_ >> (halvings_ + 1)) >= std::max(ticks.first, std::int64_t{kWindows})) {
      ++halvings_;
    }
    end_ = limit_ >> halvings_;
  }

  /// Once per tick: position of the tip, energy given by the motors since the start (N mm), and
  /// whether tip and force are those of the last tick. Returns true if the verdict is final; no
  /// more ticks are taken then.
  [[nodiscard]] bool take(double tip_mm, double given_mj, bool is_held) noexcept {
    if (tick_ == 0) {
      first_given_mj_ = most_given_mj_ = before_mj_ = given_mj;
      lowest_mm_ = highest_mm_ = tip_mm;
    }
    most_given_mj_ = std::max(most_given_mj_, given_mj);
    port_minimum_mj_ = std::min(port_minimum_mj_, first_given_mj_ - given_mj);
    Window& now = windows_[static_cast<std::size_t>((tick_ - begin_) * kWindows / (end_ - begin_))];
    now.lowest_mm = std::min(now.lowest_mm, tip_mm);
    now.highest_mm = std::max(now.highest_mm, tip_mm);
    now.given_mj = most_given_mj_;
    now.turns += turns(tip_mm) ? 1 : 0;
    ++tick_;
    held_ = is_held ? held_ + 1 : 0;
    if (held_ > settled_) {
      verdict_ = {.port_minimum_mj = port_minimum_mj_};
      return true;
    }
    if (tick_ < end_) return false;
    if (end_ == limit_ || (smooth_ && is_quiet())) {
      verdict_ = judged();
      return true;
    }
    begin_ = end_;
    end_ = limit_ >> --halvings_;
    before_mj_ = most_given_mj_;
    windows_ = {};
    return false;
  }

  [[nodiscard]] const LimitCycle& verdict() const noexcept { return verdict_; }

  /// The verdict on a run that cannot go on.
  [[nodiscard]] LimitCycle lost(double travel_mm = 0, double given_mj = 0) const noexcept {
    return {.swings = true,
            .active = true,
            .travel_mm = travel_mm,
            .given_mj = given_mj,
            .port_minimum_mj = port_minimum_mj_};
  }

 private:
  static constexpr std::int64_t kWindows = 8;  ///< of half a run
  /// In place of the step of an encoder, below that of any: a loop without one counts as at rest.
  static constexpr double kSmoothMm = 1e-4;

  struct Window {
    double lowest_mm = std::numeric_limits<double>::infinity();
    double highest_mm = -std::numeric_limits<double>::infinity();
    double given_mj = 0;  ///< the most since the start
    int turns = 0;

    [[nodiscard]] double travel_mm() const noexcept { return highest_mm - lowest_mm; }
  };

  /// Whether the tip has now come back by more than a step from its farthest point.
  bool turns(double tip_mm) noexcept {
    lowest_mm_ = std::min(lowest_mm_, tip_mm);
    highest_mm_ = std::max(highest_mm_, tip_mm);
    const bool falls = side_ >= 0 && highest_mm_ - tip_mm > most_mm_;
    const bool rises = side_ <= 0 && tip_mm - lowest_mm_ > most_mm_;
    if (!falls && !rises) return false;
    const bool is_turn = side_ != 0;  // the first motion is none
    side_ = rises ? 1 : -1;
    lowest_mm_ = highest_mm_ = tip_mm;
    return is_turn;
  }

  [[nodiscard]] double travel_mm() const noexcept {
    double lowest = windows_[0].lowest_mm, highest = windows_[0].highest_mm;
    for (const Window& window : windows_) {
      lowest = std::min(lowest, window.lowest_mm);
      highest = std::max(highest, window.highest_mm);
    }
    return highest - lowest;
  }

  [[nodiscard]] double given_mj() const noexcept { return windows_.back().given_mj - before_mj_; }

  [[nodiscard]] bool is_quiet() const noexcept {
    return travel_mm() <= most_mm_ && given_mj() <= most_mj_;
  }

  [[nodiscard]] LimitCycle judged() const noexcept {
    LimitCycle verdict{
        .travel_mm = travel_mm(), .given_mj = given_mj(), .port_minimum_mj = port_minimum_mj_};
    if (is_quiet()) return verdict;
    // A chaotic swing has so many windows of ever less travel in one of 8! cases.
    bool travel_falls = true, energy_falls = true;
    std::array<int, 2> turns{};
    double before_mj = windows_[0].given_mj, last_mj = before_mj - before_mj_;
    for (std::size_t i = 0; i < windows_.size(); ++i) {
      turns[2 * i / windows_.size()] += windows_[i].turns;
      if (i == 0) continue;
      travel_falls = travel_falls && windows_[i].travel_mm() < windows_[i - 1].travel_mm();
      const double rise_mj = windows_[i].given_mj - before_mj;
      energy_falls = energy_falls && rise_mj < last_mj;
      before_mj = windows_[i].given_mj;
      last_mj = rise_mj;
    }
    const double middle_mj = windows_[kWindows / 2 - 1].given_mj;
    constexpr int kTurns = 2;
    verdict.swings =
        verdict.travel_mm > most_mm_ && turns[0] >= kTurns && turns[1] >= kTurns && !travel_falls;
    verdict.active = middle_mj - before_mj_ > most_mj_ &&
                     windows_.back().given_mj - middle_mj > most_mj_ && !travel_falls &&
                     !energy_falls;
    verdict.undecided = !verdict.swings && (verdict.travel_mm > most_mm_ || !verdict.active);
    return verdict;
  }

  std::int64_t limit_, settled_;
  bool smooth_;
  double most_mm_, most_mj_;
  int halvings_ = 0;
  std::int64_t begin_ = 0, end_ = 0;  ///< of the half that is followed
  std::int64_t tick_ = 0, held_ = 0;
  std::array<Window, kWindows> windows_{};
  int side_ = 0;                           ///< to which the tip moves
  double lowest_mm_ = 0, highest_mm_ = 0;  ///< since it has turned
  double first_given_mj_ = 0, most_given_mj_ = 0, before_mj_ = 0, port_minimum_mj_ = 0;
  LimitCycle verdict_;
};

}  // namespace kerf
