// SPDX-License-Identifier: Apache-2.0
#include "hil/device/hand.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "shared/numeric/quick_elementary.hpp"

namespace kerf {
namespace {

constexpr double kShare = kCycleS / GuidedHand::kLagS;  // of the remaining path, in a cycle

DeviceVec<double> vec_of(const std::array<double, 3>& v) noexcept {
  return {v[0], v[1], v[2]};
}

DeviceVec<double> at_most(double length, DeviceVec<double> v) noexcept {
  const double now = norm(v);
  return now > length ? v * (length / now) : v;
}

}  // namespace

DeviceVec<double> ReachCurve::at(double progress) const noexcept {
  const double t = progress, rest = 1 - progress;
  return points_mm[0] * (rest * rest * rest) + points_mm[1] * (3 * rest * rest * t) +
         points_mm[2] * (3 * rest * t * t) + points_mm[3] * (t * t * t);
}

double ReachCurve::least_seconds(double hand_rad_per_s) const noexcept {
  constexpr int kSteps = 512;
  constexpr double kRate = kSteps;
  const auto place = [this](int step) {
    return at(minimum_jerk(std::clamp(step / kRate, 0.0, 1.0)));
  };
  double speed = 0, acceleration = 0, jerk = 0;
  for (int step = 0; step <= kSteps; ++step) {
    // Central differences over half a step to both sides of a sample, or of a gap between two.
    const auto a = place(step - 1), b = place(step), c = place(step + 1), d = place(step + 2);
    speed = std::max(speed, kRate * norm(c - b));
    acceleration = std::max(acceleration, kRate * kRate * norm(c - b * 2.0 + a));
    jerk = std::max(jerk, kRate * kRate * kRate * norm(d - c * 3.0 + b * 3.0 - a));
  }
  return std::max({speed / kMaxMmPerS, std::sqrt(acceleration / kMaxMmPerS2),
                   quick::cube_root(jerk / kSwingMm) / hand_rad_per_s});
}

ReachCurve reach_curve(const HandRoute& route, DeviceVec<double> from_mm,
                       DeviceVec<double> start_mm) noexcept {
  if (!route.detour) {
    const DeviceVec<double> third = (start_mm - from_mm) * (1.0 / 3);
    return {{from_mm, from_mm + third, start_mm - third, start_mm}};
  }
  const DeviceVec<double> above_mm = from_mm + DeviceVec<double>{0, route.detour->lift_mm, 0};
  const DeviceVec<double> beside_mm{start_mm.x, std::max(route.detour->y_mm, start_mm.y),
                                    route.detour->z_mm};
  return {{from_mm, above_mm, beside_mm, start_mm}};
}

HandMotion::HandMotion(const HandScript& script, const HandRoute& route)
    : route_(route),
      start_mm_(vec_of(script.start) * script.unit_mm.value_or(1)),
      from_mm_(route.rest_tip_mm) {
  for (const HandStep& step : route.calibration) add(step, 1.0);
  reach_ = legs_.size();
  legs_.emplace_back();
  begin_reach();
  for (const HandStep& step : script.steps) add(step, script.unit_mm.value_or(1));
  repeat_from_ = script.repeat_from ? reach_ + 1 + *script.repeat_from : legs_.size();
}

void HandMotion::calibrate() noexcept {
  if (phase_ == Phase::resting) phase_ = Phase::calibrating;
}

void HandMotion::leave() noexcept {
  if (phase_ == Phase::resting) {
    leg_ = reach_;
    begin_reach();
  }
  phase_ = Phase::left;  // a motion of the calibration that has begun comes to its end
}

void HandMotion::rest() noexcept {
  phase_ = Phase::resting;
  leg_ = 0;
  cycle_ = 0;
  from_mm_ = route_.rest_tip_mm;
  from_orientation_rad_ = {};
}

void HandMotion::add(const HandStep& step, double unit_mm) {
  Leg leg{step, std::max<std::int64_t>(1, cycles_of(step.seconds))};
  for (double& length : leg.step.to) length *= unit_mm;
  for (double& length : leg.step.size) length *= unit_mm;
  leg.step.sink *= unit_mm;
  legs_.push_back(leg);
}

void HandMotion::begin_reach() noexcept {
  way_ = reach_curve(route_, from_mm_, start_mm_);
  legs_[reach_].cycles =
      std::max<std::int64_t>(1, cycles_of(way_.least_seconds(route_.hand_rad_per_s)));
}

DeviceVec<double> HandMotion::position(const Leg& leg, double progress) const noexcept {
  if (&leg == &legs_[reach_]) return way_.at(progress);
  const HandStep& step = leg.step;
  const double turn = 2 * std::numbers::pi * progress;
  const DeviceVec<double> sunk{0, -step.sink * progress, 0};
  switch (step.kind) {
    case HandStep::Kind::hold:
      return from_mm_;
    case HandStep::Kind::move:
      return from_mm_ + (vec_of(step.to) - from_mm_) * progress;
    case HandStep::Kind::circle: {
      // A quarter of the way spirals out, a quarter back in.
      constexpr double kQuarters = 4.0;
      const double radius =
          step.size[0] *
          minimum_jerk(std::min({1.0, kQuarters * progress, kQuarters * (1 - progress)}));
      return from_mm_ + sunk +
             DeviceVec<double>{radius * quick::cosine(turn * step.turns), 0,
                               radius * quick::sine(turn * step.turns)};
    }
    case HandStep::Kind::zigzag:
      return from_mm_ + sunk +
             DeviceVec<double>{0.5 * step.size[0] * quick::sine(turn * step.turns), 0,
                               0.5 * step.size[1] * quick::sine(turn)};
  }
  return from_mm_;
}

void HandMotion::begin_next_leg() noexcept {
  const Leg& done = legs_[leg_];
  from_mm_ = position(done, 1.0);
  if (done.step.orientation_rad) from_orientation_rad_ = *done.step.orientation_rad;
  cycle_ = 0;
  ++leg_;
  if (leg_ == legs_.size()) leg_ = repeat_from_;
  if (leg_ == reach_) {
    if (left()) {
      begin_reach();
    } else {
      leg_ = 0;  // the calibration again, until it leaves
    }
  }
}

HandGoal HandMotion::next() noexcept {
  HandGoal goal;
  const bool moves = left() || (phase_ == Phase::calibrating && reach_ > 0);
  goal.calibrate = phase_ == Phase::calibrating && !moves;
  if (!moves) return goal;
  goal.in_inkwell = false;
  goal.target_mm = from_mm_;
  goal.orientation_rad = from_orientation_rad_;
  if (leg_ == legs_.size()) return goal;  // the script has ended: stay

  const Leg& leg = legs_[leg_];
  ++cycle_;
  const double t = static_cast<double>(cycle_) / static_cast<double>(leg.cycles);
  const double progress = leg.step.ease == HandStep::Ease::smooth ? minimum_jerk(t) : t;
  goal.target_mm = position(leg, progress);
  goal.button1 = leg.step.button == 1;
  goal.button2 = leg.step.button == 2;
  if (leg.step.orientation_rad) {
    for (std::size_t i = 0; i < 3; ++i) {
      goal.orientation_rad[i] +=
          ((*leg.step.orientation_rad)[i] - from_orientation_rad_[i]) * progress;
    }
  }
  if (cycle_ == leg.cycles) begin_next_leg();
  return goal;
}

GuidedHand::GuidedHand(double stiffness_n_per_mm, const HandRoute& route,
                       DeviceVec<double> start_mm) noexcept
    : max_pull_mm_(kMaxPullN / stiffness_n_per_mm), first_button_parks_(route.first_button_parks) {
  const ReachCurve way = reach_curve(route, route.rest_tip_mm, start_mm);
  std::reverse_copy(way.points_mm.begin(), way.points_mm.end(), way_back_mm_.begin());
}

void GuidedHand::set_target(const HandTarget& target) noexcept {
  target_ = target;
  if (target.park && !parking_) parking_ = 0;
  since_target_ = 0;
  held_mm_.reset();
}

void GuidedHand::restart() noexcept {
  target_.reset();
  goal_.reset();
  held_mm_.reset();
  parking_.reset();
  since_target_ = 0;
  parked_for_ = 0;
}

void GuidedHand::release() noexcept {
  since_target_ = std::max(since_target_, cycles_of(kStaleS));
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
  return stale ? *held_mm_ : target_->tip_mm;
}

HandGoal GuidedHand::next(const HandGoal& start, DeviceVec<double> tip_mm) noexcept {
  if (!target_) return start;
  if (!goal_) goal_ = start;
  const bool stale = since_target_ >= cycles_of(kStaleS);
  if (stale && !held_mm_) held_mm_ = tip_mm;
  const bool withdraws = since_target_ >= cycles_of(kStaleS + kPatienceS);
  if (!withdraws) ++since_target_;
  const DeviceVec<double> aim_mm = aim(stale, withdraws, start.target_mm);
  const double speed = parking_ ? kParkMmPerS : withdraws ? kWithdrawMmPerS : kMaxSpeedMmPerS;
  const DeviceVec<double> step = at_most(speed * kCycleS, (aim_mm - goal_->target_mm) * kShare);
  goal_->target_mm = tip_mm + at_most(max_pull_mm_, goal_->target_mm + step - tip_mm);
  for (std::size_t i = 0; i < 3; ++i) {
    const double turn = (target_->orientation_rad[i] - goal_->orientation_rad[i]) * kShare;
    constexpr double kMost = kMaxTurnRadPerS * kCycleS;
    goal_->orientation_rad[i] += std::clamp(turn, -kMost, kMost);
  }
  const bool follows = !stale && !parking_;  // who leaves or parks presses no pedal
  goal_->button1 = follows && target_->button1;
  goal_->button2 = follows && target_->button2;
  if (first_button_parks_) std::swap(goal_->button1, goal_->button2);
  goal_->in_inkwell = parking_ == way_back_mm_.size();
  if (goal_->in_inkwell) ++parked_for_;
  return *goal_;
}

}  // namespace kerf
