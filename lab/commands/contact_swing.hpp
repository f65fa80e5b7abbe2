// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>

#include "controller/stability/limit_cycle.hpp"
#include "shared/segment/layout.hpp"

namespace kerf::sweep {

/// The verdict of `LimitCycleDetector` on the contacts of a run of the whole servo, tick by tick.
///
/// A watch of the detector is `kSeconds` long; one begins every `kApartS` while the tool touches,
/// so that each hold of the hand of 0.6 s or more has one of its own. The coordinate is the
/// penetration, 0 in air: a tool that jumps off the solid swings, too. The energy that the motors
/// give is what goes below the least energy of the port so far: a spring that returns what the hand
/// stored gives none.
class ContactSwing {
 public:
  static constexpr double kSeconds = 0.5, kApartS = 0.1;

  /// `step_mm`: of the encoders, at the tip, in mm of the scene.
  ContactSwing(double rate_hz, double step_mm)
      : ticks_(static_cast<std::int64_t>(kSeconds * rate_hz)),
        apart_(static_cast<std::uint64_t>(kApartS * rate_hz)),
        step_mm_(step_mm) {}

  /// Once per tick, in order.
  void take(const TickRecord& record) {
    constexpr std::uint32_t kTouches = kFlagContact | kFlagStarted;
    if ((record.flags & kTouches) == kTouches && record.tick >= next_tick_) {
      // Not ended before its time, whatever is held: `settled` is its whole length.
      watches_.emplace_back(LimitCycleDetector::Ticks{ticks_, ticks_, ticks_}, step_mm_, kPushN);
      next_tick_ = record.tick + std::max<std::uint64_t>(1, apart_);
    }
    constexpr double kMjPerJ = 1000;
    const double tip_mm = -double{record.penetration_mm};
    const double given_mj = -record.port_minimum_j * kMjPerJ;
    std::erase_if(watches_, [&](LimitCycleDetector& watch) {
      if (!watch.take(tip_mm, given_mj, false)) return false;
      add(watch.verdict());
      return true;
    });
  }

  /// `swings`, `active`, `rest` or `undecided`, as docs/scenes.md has them; empty without a
  /// verdict.
  [[nodiscard]] const char* word() const {
    if (swings_) return "swings";
    if (active_) return "active";
    if (rests_) return "rest";
    return undecided_ ? "undecided" : "";
  }

 private:
  static constexpr double kPushN = 0.5;  ///< as of a map of stability

  void add(const LimitCycle& verdict) {
    swings_ = swings_ || verdict.swings;
    active_ = active_ || verdict.active;
    undecided_ = undecided_ || verdict.undecided;
    rests_ = rests_ || verdict.rests();
  }

  std::int64_t ticks_;
  std::uint64_t apart_;
  double step_mm_;
  std::uint64_t next_tick_ = 0;
  std::deque<LimitCycleDetector> watches_;
  bool swings_ = false, active_ = false, undecided_ = false, rests_ = false;
};

}  // namespace kerf::sweep
