// SPDX-License-Identifier: Apache-2.0
#include "lab/safety/emulated_program.hpp"

#include <limits>

namespace kerf::faults {

double EmulatedProgram::any(double most) {
  return most * (2 * static_cast<double>(random_()) / std::mt19937::max() - 1);
}

bool EmulatedProgram::push(const ServoOutput& last, AnyServo& servo) {
  ProgramForce force;
  const auto& [x, y, z] = last.position_mm;
  was_above_ = was_above_ || (last.motors_on && y > kFloorMm);
  if (was_above_ && y < kFloorMm) {
    force.goal_mm = {x, kFloorMm, z};
    force.stiffness_n_per_mm = scene_.stiffness_n_per_mm;
    force.damping_ns_per_mm = scene_.damping_ns_per_mm;
  }
  return servo.give_force(0, force);
}

bool EmulatedProgram::flood(AnyServo& servo) {
  constexpr int kForces = 20;
  bool taken = false;
  for (int i = 0; i < kForces; ++i) {
    const bool allowed = i % 2 == 0;
    const double most_n = allowed ? 255 : 1e30, times = allowed ? 1 : 1e6;
    ProgramForce force;
    for (double& axis_n : force.force_n) axis_n = any(most_n);
    for (double& axis_mm : force.goal_mm) axis_mm = any(allowed ? 1e4 : 1e300);
    force.stiffness_n_per_mm = times * scene_.stiffness_n_per_mm;
    force.damping_ns_per_mm = times * scene_.damping_ns_per_mm;
    taken = servo.give_force(0, force) || taken;
  }
  return taken;
}

bool EmulatedProgram::turn(double time_ms, const ServoOutput& last, AnyServo& servo) {
  constexpr double kWrongMs = 300, kPeriodMs = 5;
  const double wrong_ms = wrong_since_ms_ < 0 ? -1 : time_ms - wrong_since_ms_;
  const bool is_wrong = wrong_ms >= 0 && (way_ == ProgramWay::dies || wrong_ms < kWrongMs);
  if (is_wrong && way_ == ProgramWay::floods) return flood(servo);
  if (is_wrong && (way_ == ProgramWay::stops || way_ == ProgramWay::dies)) return false;
  if (time_ms < next_turn_ms_) return false;
  next_turn_ms_ = time_ms + kPeriodMs;
  if (is_wrong && way_ == ProgramWay::no_numbers) {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    constexpr double kTooMuch = std::numeric_limits<double>::infinity();
    const bool taken = servo.give_force(0, {.force_n = {0, kNone, 0}});
    return servo.give_force(0, {.force_n = {kTooMuch, 0, 0}}) || taken;
  }
  return push(last, servo);
}

}  // namespace kerf::faults
