// SPDX-License-Identifier: Apache-2.0
#include "hil/devmodel/hand_motion.hpp"

#include <algorithm>
#include <cmath>

#include "shared/wire/omni_constants.hpp"

namespace kerf {
namespace {

// The way out of the inkwell, device mm. All of it is inside the elbow's limits.
constexpr double kLiftMm = 25.0;     // straight up
constexpr double kClearYMm = 15.0;   // then over this height ...
constexpr double kClearZMm = -60.0;  // ... behind the workpiece
constexpr double kLiftS = 0.25;
constexpr double kCrossS = 0.45;
constexpr double kApproachS = 0.5;

/// Position along a rest-to-rest motion of least jerk (Flash and Hogan 1985).
double smooth(double t) noexcept {
  return t * t * t * (10 + t * (-15 + 6 * t));
}

DeviceVec<double> vec_of(const std::array<double, 3>& v) noexcept {
  return {v[0], v[1], v[2]};
}

HandStep move_to(std::array<double, 3> to, double seconds) {
  HandStep step;
  step.kind = HandStep::Kind::move;
  step.seconds = seconds;
  step.to = to;
  return step;
}

}  // namespace

HandMotion::HandMotion(const HandScript& script, DeviceVec<double> dock_tip_mm)
    : from_mm_(dock_tip_mm) {
  const double unit = script.unit_mm;
  const std::array<double, 3> start{script.start[0] * unit, script.start[1] * unit,
                                    script.start[2] * unit};
  add(move_to({dock_tip_mm.x, dock_tip_mm.y + kLiftMm, dock_tip_mm.z}, kLiftS), 1.0);
  add(move_to({start[0], std::max(kClearYMm, start[1]), kClearZMm}, kCrossS), 1.0);
  add(move_to(start, kApproachS), 1.0);
  const std::size_t prelude = legs_.size();
  for (const HandStep& step : script.steps) add(step, unit);
  repeat_from_ = script.repeat_from ? prelude + *script.repeat_from : legs_.size();
}

void HandMotion::add(const HandStep& step, double unit_mm) {
  Leg leg{step, std::max<std::int64_t>(1, std::llround(step.seconds * omni::kBusCyclesPerSecond))};
  for (double& length : leg.step.to) length *= unit_mm;
  for (double& length : leg.step.size) length *= unit_mm;
  leg.step.sink *= unit_mm;
  legs_.push_back(leg);
}

DeviceVec<double> HandMotion::position(const Leg& leg, double progress) const noexcept {
  const HandStep& step = leg.step;
  const double turn = 2 * omni::kPi * progress;
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
}

HandGoal HandMotion::next() noexcept {
  HandGoal goal;
  if (!left_) return goal;
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
