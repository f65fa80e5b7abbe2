// SPDX-License-Identifier: Apache-2.0
#include "hil/devmodel/hand_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hil/devmodel/bus_cycle.hpp"

namespace kerf {
namespace {

/// Position along a rest-to-rest motion of least jerk (Flash and Hogan 1985).
double smooth(double t) noexcept {
  return t * t * t * (10 + t * (-15 + 6 * t));
}

DeviceVec<double> vec_of(const std::array<double, 3>& v) noexcept {
  return {v[0], v[1], v[2]};
}

}  // namespace

HandMotion::HandMotion(const HandScript& script, const HandRoute& route)
    : rest_mm_(route.rest_tip_mm),
      start_mm_(vec_of(script.start) * script.unit_mm),
      from_mm_(route.rest_tip_mm) {
  const DeviceVec<double> rest = rest_mm_;
  const DeviceVec<double> start = start_mm_;
  for (const HandStep& step : route.calibration) add(step, 1.0);
  leaves_at_ = legs_.size();
  if (route.lift_mm > 0) {
    add(hand_move(rest + DeviceVec<double>{0, route.lift_mm, 0}, route.lift_s), 1.0);
  }
  if (route.cross_s > 0) {
    const double clear_y = std::max(route.clear_y_mm, start.y);
    add(hand_move({start.x, clear_y, route.clear_z_mm}, route.cross_s), 1.0);
  }
  add(hand_move(start, route.approach_s), 1.0);
  const std::size_t script_from = legs_.size();
  for (const HandStep& step : script.steps) add(step, script.unit_mm);
  repeat_from_ = script.repeat_from ? script_from + *script.repeat_from : legs_.size();
}

void HandMotion::calibrate() noexcept {
  if (phase_ == Phase::resting) phase_ = Phase::calibrating;
}

void HandMotion::leave() noexcept {
  if (phase_ == Phase::resting) leg_ = leaves_at_;
  phase_ = Phase::left;  // a motion of the calibration that has begun comes to its end
}

void HandMotion::rest() noexcept {
  phase_ = Phase::resting;
  leg_ = 0;
  cycle_ = 0;
  from_mm_ = rest_mm_;
  from_orientation_rad_ = {};
}

void HandMotion::add(const HandStep& step, double unit_mm) {
  Leg leg{step, std::max<std::int64_t>(1, cycles_of(step.seconds))};
  for (double& length : leg.step.to) length *= unit_mm;
  for (double& length : leg.step.size) length *= unit_mm;
  leg.step.sink *= unit_mm;
  legs_.push_back(leg);
}

DeviceVec<double> HandMotion::position(const Leg& leg, double progress) const noexcept {
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
          step.size[0] * smooth(std::min({1.0, kQuarters * progress, kQuarters * (1 - progress)}));
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
  if (leg_ == leaves_at_ && phase_ == Phase::calibrating) leg_ = 0;  // again, until it leaves
}

HandGoal HandMotion::next() noexcept {
  HandGoal goal;
  const bool moves = left() || (phase_ == Phase::calibrating && leaves_at_ > 0);
  goal.calibrate = phase_ == Phase::calibrating && !moves;
  if (!moves) return goal;
  goal.in_inkwell = false;
  goal.target_mm = from_mm_;
  goal.orientation_rad = from_orientation_rad_;
  if (leg_ == legs_.size()) return goal;  // the script has ended: stay

  const Leg& leg = legs_[leg_];
  ++cycle_;
  const double t = static_cast<double>(cycle_) / static_cast<double>(leg.cycles);
  const double progress = leg.step.ease == HandStep::Ease::smooth ? smooth(t) : t;
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
