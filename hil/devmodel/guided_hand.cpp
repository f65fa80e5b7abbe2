// SPDX-License-Identifier: Apache-2.0
#include "hil/devmodel/guided_hand.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "hil/devmodel/reach_curve.hpp"

namespace kerf {
namespace {

constexpr double kShare = kCycleS / GuidedHand::kLagS;  // of the way that is left, in a cycle

DeviceVec<double> at_most(double length, DeviceVec<double> v) noexcept {
  const double now = norm(v);
  return now > length ? v * (length / now) : v;
}

}  // namespace

GuidedHand::GuidedHand(double stiffness_n_per_mm, const HandRoute& route,
                       DeviceVec<double> start_mm) noexcept
    : max_pull_mm_(kMaxPullN / stiffness_n_per_mm) {
  const ReachCurve way = reach_curve(route, route.rest_tip_mm, start_mm);
  std::reverse_copy(way.points_mm.begin(), way.points_mm.end(), way_back_mm_.begin());
}

void GuidedHand::wish(const HandWish& wish) noexcept {
  wish_ = wish;
  if (wish.park && !parking_) parking_ = 0;
  since_wish_ = 0;
  held_mm_.reset();
}

void GuidedHand::restart() noexcept {
  wish_.reset();
  goal_.reset();
  held_mm_.reset();
  parking_.reset();
  since_wish_ = 0;
  parked_for_ = 0;
}

void GuidedHand::forsake() noexcept {
  since_wish_ = std::max(since_wish_, cycles_of(kStaleS));
}

DeviceVec<double> GuidedHand::retreat(DeviceVec<double> start_mm) const noexcept {
  constexpr double kThereMm = 0.1;
  const bool is_up = goal_->target_mm.y >= start_mm.y - kThereMm;
  const DeviceVec<double> from_mm = held_mm_.value_or(goal_->target_mm);
  return is_up ? start_mm : DeviceVec<double>{from_mm.x, start_mm.y, from_mm.z};
}

DeviceVec<double> GuidedHand::aim(bool stale, bool withdraws, DeviceVec<double> start_mm) noexcept {
  if (parking_) {
    constexpr double kThereMm = 0.2;
    if (*parking_ < way_back_mm_.size() &&
        norm(goal_->target_mm - way_back_mm_[*parking_]) < kThereMm) {
      ++*parking_;
    }
    if (*parking_ == 0) return retreat(start_mm);
    return way_back_mm_[std::min(*parking_, way_back_mm_.size() - 1)];
  }
  if (withdraws) return retreat(start_mm);
  return stale ? *held_mm_ : wish_->tip_mm;
}

HandGoal GuidedHand::next(const HandGoal& start, DeviceVec<double> tip_mm) noexcept {
  if (!wish_) return start;
  if (!goal_) goal_ = start;
  const bool stale = since_wish_ >= cycles_of(kStaleS);
  if (stale && !held_mm_) held_mm_ = tip_mm;
  const bool withdraws = since_wish_ >= cycles_of(kStaleS + kPatienceS);
  if (!withdraws) ++since_wish_;
  const DeviceVec<double> aim_mm = aim(stale, withdraws, start.target_mm);
  const double speed = parking_ ? kParkMmPerS : withdraws ? kWithdrawMmPerS : kMaxSpeedMmPerS;
  const DeviceVec<double> step = at_most(speed * kCycleS, (aim_mm - goal_->target_mm) * kShare);
  goal_->target_mm = tip_mm + at_most(max_pull_mm_, goal_->target_mm + step - tip_mm);
  for (std::size_t i = 0; i < 3; ++i) {
    const double turn = (wish_->orientation_rad[i] - goal_->orientation_rad[i]) * kShare;
    constexpr double kMost = kMaxTurnRadPerS * kCycleS;
    goal_->orientation_rad[i] += std::clamp(turn, -kMost, kMost);
  }
  goal_->button1 = !stale && wish_->button1;
  goal_->button2 = !stale && wish_->button2;
  goal_->in_inkwell = parking_ == way_back_mm_.size();
  if (goal_->in_inkwell) ++parked_for_;
  return *goal_;
}

}  // namespace kerf
