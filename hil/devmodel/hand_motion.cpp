// SPDX-License-Identifier: Apache-2.0
#include "hil/devmodel/hand_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hil/devmodel/bus_cycle.hpp"

namespace kerf {
namespace {

DeviceVec<double> vec_of(const std::array<double, 3>& v) noexcept {
  return {v[0], v[1], v[2]};
}

}  // namespace

HandMotion::HandMotion(const HandScript& script, const HandRoute& route)
    : route_(route), start_mm_(vec_of(script.start) * script.unit_mm), from_mm_(route.rest_tip_mm) {
  for (const HandStep& step : route.calibration) add(step, 1.0);
  reach_ = legs_.size();
  legs_.emplace_back();
  begin_reach();
  for (const HandStep& step : script.steps) add(step, script.unit_mm);
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
          least_jerk(std::min({1.0, kQuarters * progress, kQuarters * (1 - progress)}));
      return from_mm_ + sunk +
             DeviceVec<double>{radius * std::cos(turn * step.turns), 0,
                               radius * std::sin(turn * step.turns)};
    }
    case HandStep::Kind::zigzag:
      return from_mm_ + sunk +
             DeviceVec<double>{0.5 * step.size[0] * std::sin(turn * step.turns), 0,
                               0.5 * step.size[1] * std::sin(turn)};
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
  const double progress = leg.step.ease == HandStep::Ease::smooth ? least_jerk(t) : t;
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

}  // namespace kerf
