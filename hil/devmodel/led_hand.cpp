// SPDX-License-Identifier: Apache-2.0
#include "hil/devmodel/led_hand.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace kerf {
namespace {

constexpr double kShare = kCycleS / LedHand::kLagS;  // of the way that is left, in a cycle

DeviceVec<double> at_most(double length, DeviceVec<double> v) noexcept {
  const double now = norm(v);
  return now > length ? v * (length / now) : v;
}

}  // namespace

void LedHand::wish(const HandWish& wish) noexcept {
  wish_ = wish;
  since_wish_ = 0;
  held_mm_.reset();
}

void LedHand::forsake() noexcept {
  since_wish_ = std::max(since_wish_, cycles_of(kStaleS));
}

DeviceVec<double> LedHand::retreat(DeviceVec<double> start_mm) const noexcept {
  constexpr double kThereMm = 0.1;
  const bool is_up = goal_->target_mm.y >= start_mm.y - kThereMm;
  return is_up ? start_mm : DeviceVec<double>{held_mm_->x, start_mm.y, held_mm_->z};
}

HandGoal LedHand::next(const HandGoal& start, DeviceVec<double> tip_mm) noexcept {
  if (!wish_) return start;
  if (!goal_) goal_ = start;
  const bool stale = since_wish_ >= cycles_of(kStaleS);
  if (stale && !held_mm_) held_mm_ = tip_mm;
  const bool withdraws = since_wish_ >= cycles_of(kStaleS + kPatienceS);
  if (!withdraws) ++since_wish_;
  const DeviceVec<double> aim_mm = withdraws ? retreat(start.target_mm)
                                   : stale   ? *held_mm_
                                             : wish_->tip_mm;
  const double speed = withdraws ? kWithdrawMmPerS : kMaxSpeedMmPerS;
  const DeviceVec<double> step = at_most(speed * kCycleS, (aim_mm - goal_->target_mm) * kShare);
  goal_->target_mm = tip_mm + at_most(max_pull_mm_, goal_->target_mm + step - tip_mm);
  for (std::size_t i = 0; i < 3; ++i) {
    const double turn = (wish_->orientation_rad[i] - goal_->orientation_rad[i]) * kShare;
    constexpr double kMost = kMaxTurnRadPerS * kCycleS;
    goal_->orientation_rad[i] += std::clamp(turn, -kMost, kMost);
  }
  goal_->button1 = !stale && wish_->button1;
  goal_->button2 = !stale && wish_->button2;
  return *goal_;
}

}  // namespace kerf
