// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>

#include "controller/servo/kinematics.hpp"
#include "controller/servo/servo.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"
#include "controller/servo/supervisor.hpp"
#include "shared/numeric/vec.hpp"

// The first part of a tick: from a report to the tip and its velocity, and whether the motors may
// be on.

namespace kerf {

/// Pose of the device, from one good report.
template <class N>
struct DevicePose {
  ForwardKinematics<N> arm;
  Rotation<N> rotation = identity_rotation<N>();
  std::array<typename N::Angle, 3> gimbal{};  ///< yaw, pitch, roll
};

/// One tick without a fresh report. If the servo is faster than the device, the last report, and
/// with it a rest, remains valid for as long as a force is held.
inline void follow_silence(const SafetyTiming& timing, EncoderState& encoders) noexcept {
  encoders.silent_ticks += encoders.silent_ticks <= timing.hold_ticks ? 1U : 0U;
  const bool rests = encoders.rest_ticks > 0 && encoders.silent_ticks <= timing.hold_ticks;
  encoders.rest_ticks = rests ? std::min(encoders.rest_ticks + 1, timing.rest_ticks) : 0;
}

/// Counts ticks that the host skipped: they had no report.
inline void miss_ticks(const SafetyTiming& timing, std::uint32_t ticks,
                       EncoderState& encoders) noexcept {
  const std::uint32_t counted = std::min(ticks, timing.hold_ticks + 1);
  for (std::uint32_t i = 0; i < counted; ++i) follow_silence(timing, encoders);
}

/// Whether this report completes a rest that is long enough for a calibration, and where.
enum class Rest : std::uint8_t {
  none,
  docked,    ///< at the pose of the first calibration, or this is the first: calibrated
  elsewhere  ///< a false parked bit, or lost counts: nothing changes
};

/// Whether these counts are those of the first calibration, within `dock_counts`. The first call
/// stores them and returns true.
[[nodiscard]] inline bool fits_dock(const std::array<std::int16_t, 3>& count,
                                    const std::array<std::int32_t, 3>& dock_counts,
                                    EncoderState& encoders) noexcept {
  if (!encoders.dock) encoders.dock = count;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int32_t off = static_cast<std::int16_t>(count[i] - (*encoders.dock)[i]);
    if (std::abs(off) > dock_counts[i]) return false;
  }
  return true;
}

/// One tick of the encoders, unwrapped beyond 16 bits. If the device is homed and has been parked
/// at rest at its dock for `rest_ticks`, it is calibrated: the counters restart from 0, or from the
/// device's absolute counts. Returns `Rest::none` for a report that is not fresh.
///
/// At rest, no counter moves farther than `rest_counts` from its first value. On a device with
/// absolute encoders, which a hand may hold, the limit is from one report to the next.
template <class N>
inline Rest follow_encoders(const DeviceReport& report, const DevicePlan<N>& device,
                            const SafetyTiming& timing, EncoderState& encoders) noexcept {
  if (!report.fresh) {
    follow_silence(timing, encoders);
    return Rest::none;
  }
  const bool absolute = device.absolute_encoders;
  encoders.silent_ticks = 0;
  bool at_rest = report.parked && report.homed;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto step = static_cast<std::int16_t>(report.counts[i] - encoders.last[i]);
    constexpr std::int64_t kEnd = std::numeric_limits<std::int32_t>::max();  // either sign fits
    encoders.unwrapped[i] = static_cast<std::int32_t>(
        std::clamp(std::int64_t{encoders.unwrapped[i]} + step, -kEnd, kEnd));
    // The position of a Cartesian device is whole in its counts, so it is taken, not summed up.
    if (device.kinematics == Kinematics::axes) encoders.unwrapped[i] = report.counts[i];
    encoders.last[i] = report.counts[i];
    const auto moved =
        absolute ? step : static_cast<std::int16_t>(report.counts[i] - encoders.rest_from[i]);
    at_rest = at_rest && moved >= -device.rest_counts && moved <= device.rest_counts;
  }
  if (!at_rest) encoders.rest_from = report.counts;
  encoders.rest_ticks = at_rest ? std::min(encoders.rest_ticks + 1, timing.rest_ticks) : 0;
  if (encoders.rest_ticks < timing.rest_ticks) return Rest::none;
  if (!fits_dock(report.counts, device.dock_counts, encoders)) return Rest::elsewhere;
  encoders.unwrapped = {};
  if (absolute) std::ranges::copy(report.counts, encoders.unwrapped.begin());
  return Rest::docked;
}

/// Adds a reading to the sum over the last `samples` readings, 1 to kMaxGimbalSamples.
inline void follow_gimbal(const DeviceReport& report, std::size_t samples,
                          GimbalFilter& filter) noexcept {
  auto& oldest = filter.ring[filter.next];
  for (std::size_t i = 0; i < 3; ++i) {
    filter.sum[i] += report.wiper_a[i] - std::uint32_t{oldest[i]};
    filter.sum[i + 3] += report.wiper_b[i] - std::uint32_t{oldest[i + 3]};
    oldest[i] = report.wiper_a[i];
    oldest[i + 3] = report.wiper_b[i];
  }
  filter.next = (filter.next + 1) % samples;
}

/// Angle of `counts` encoder steps from home, clamped to +-8 rad, where fixed saturates: no joint
/// of a device goes farther, and the tip must stay within the range of floats.
template <class N>
[[nodiscard]] constexpr typename N::Angle joint_angle(const JointPlan<N>& joint,
                                                      std::int32_t counts) noexcept {
  if constexpr (N::kIsFixed) {
    return joint.home_rad + N::Angle::from_wide(counts * joint.angle_per_count, kAnglePerCountBits);
  } else {
    constexpr typename N::Angle kEnd(8);
    return std::clamp(joint.home_rad + typename N::Angle(joint.angle_per_count * counts), -kEnd,
                      kEnd);
  }
}

/// A length in mm from the counts of a Cartesian device.
template <class N>
[[nodiscard]] constexpr typename N::Real length_mm(const JointPlan<N>& axis,
                                                   std::int32_t counts) noexcept {
  if constexpr (N::kIsFixed) {
    return N::Real::from_wide(counts * axis.angle_per_count, kAnglePerCountBits);
  } else {
    return typename N::Real(axis.angle_per_count * counts);
  }
}

/// Forward kinematics from the unwrapped joint counts and the gimbal's averaged readings, or the
/// orientation that a Cartesian device reports. Without a gimbal the tool never turns.
template <class N>
[[nodiscard]] DevicePose<N> device_pose(const DevicePlan<N>& device, const EncoderState& encoders,
                                        const GimbalFilter& gimbal) noexcept {
  if (device.kinematics == Kinematics::axes) {
    DevicePose<N> pose;
    pose.arm = cartesian_pose<N>({length_mm(device.joints[0], encoders.unwrapped[0]),
                                  length_mm(device.joints[1], encoders.unwrapped[1]),
                                  length_mm(device.joints[2], encoders.unwrapped[2])});
    pose.rotation = rotation_of<N>(gimbal.orientation);
    return pose;
  }
  std::array<typename N::Angle, 3> angles;
  for (std::size_t i = 0; i < 3; ++i) {
    angles[i] = joint_angle(device.joints[i], encoders.unwrapped[i]);
  }
  DevicePose<N> pose;
  if (device.kinematics == Kinematics::delta) {
    pose.arm = delta_arm_pose(device.delta, angles);
    return pose;
  }
  const SerialJoints<N> joints{angles[0], angles[1], angles[2]};
  pose.arm = serial_arm_pose(device.serial, joints);
  if (device.has_gimbal) {
    pose.gimbal = omni_gimbal<N>({gimbal.sum[0], gimbal.sum[1], gimbal.sum[2]},
                                 {gimbal.sum[3], gimbal.sum[4], gimbal.sum[5]});
    pose.rotation = omni_orientation<N>(joints, pose.gimbal);
  }
  return pose;
}

/// Motion of the tip since it was last known.
struct TipMotion {
  bool overspeed = false;  ///< faster than the limit
  bool leaves = false;     ///< moves along the force of the last tick
};

/// Updates the tip. The energy ledger books the motion at the mean of the forces that were sent
/// meanwhile, as if it had been uniform.
template <class N>
TipMotion move_tip(const ServoPlan<N>& plan, ServoState<N>& state,
                   const DevicePose<N>& pose) noexcept {
  using Real = typename N::Real;
  constexpr std::uint32_t kMostMean = 32'000;  // a Real holds it; the force is long faded by then
  const std::uint32_t since = std::clamp<std::uint32_t>(state.tip_ticks, 1, kMostMean);
  const std::uint32_t gap = std::min<std::uint32_t>(since, 1000);
  if (!state.tip_known) state.tip_mm = pose.arm.tip_mm;
  const auto moved_mm = pose.arm.tip_mm - state.tip_mm;
  const auto ticks = Real(static_cast<double>(gap));
  const auto summed = Real(static_cast<double>(since));
  const DeviceVec<Real> sent_n =
      gap == 1 ? state.force_n
               : DeviceVec<Real>{state.force_sum_n.x / summed, state.force_sum_n.y / summed,
                                 state.force_sum_n.z / summed};
  state.ledger.move(sent_n, moved_mm, gap);
  state.velocity_mm_per_s =
      plan.velocity(state.velocity, {pose.arm.tip_mm, gap, !state.velocity.begun});
  state.moved_mm = moved_mm;
  state.moved_ticks = gap;
  state.tip_mm = pose.arm.tip_mm;
  state.rotation = pose.rotation;
  state.tip_known = true;
  state.tip_ticks = 0;
  state.force_sum_n = {};
  return {norm(moved_mm) > plan.speed_limit_mm_per_tick * ticks,
          dot(state.force_n, moved_mm) > Real(0)};
}

/// The result of `sense`.
template <class N>
struct Sensed {
  DevicePose<N> pose;
  bool usable = false;  ///< a fresh report with a finite pose
  bool leaves = false;  ///< the hand moves along the force of the last tick
  bool docked = false;  ///< parked at rest: calibrated in this tick
  WorldVec<typename N::Real> tip_mm;
  DeviceVec<typename N::Real> velocity_mm_per_s;
};

/// Finds the pose of the device and checks it, and runs the supervisor.
template <class N>
[[nodiscard]] Sensed<N> sense(const ServoPlan<N>& plan, ServoState<N>& state,
                              const DeviceReport& report) noexcept {
  SafetyInputs seen{.fresh = report.fresh, .parked = report.parked, .homed = report.homed};
  const Rest rest = follow_encoders(report, plan.device, plan.timing, state.encoders);
  seen.calibrated = rest == Rest::docked;
  seen.misplaced = rest == Rest::elsewhere;
  if (report.fresh) {
    if (plan.device.kinematics == Kinematics::axes) {
      state.gimbal.orientation = report.orientation;
    } else {
      follow_gimbal(report, plan.device.gimbal_samples, state.gimbal);
    }
  }
  Sensed<N> sensed;
  sensed.pose = device_pose(plan.device, state.encoders, state.gimbal);
  seen.finite = all_finite(sensed.pose.arm.tip_mm) && sensed.pose.arm.closes;
  sensed.usable = seen.fresh && seen.finite;
  sensed.docked = seen.calibrated;
  state.tip_ticks += state.tip_ticks < UINT32_MAX ? 1U : 0U;
  if (sensed.usable) {
    state.jacobian_t_mm = sensed.pose.arm.jacobian_t_mm;
    // Calibration may change the counters, and so the tip, although the device rests.
    if (sensed.docked) state.velocity.begin_anew();
    const TipMotion motion = move_tip(plan, state, sensed.pose);
    seen.overspeed = motion.overspeed && !report.parked;
    sensed.leaves = motion.leaves;
  }
  const bool known_velocity = all_finite(state.velocity_mm_per_s);
  if (!known_velocity) {
    state.velocity.begin_anew();
    state.velocity_mm_per_s = {};
  }
  sensed.velocity_mm_per_s = state.velocity_mm_per_s;
  sensed.tip_mm = relabel<WorldSpace>(state.tip_mm * plan.workspace_scale) + plan.offset_mm;
  supervise(plan.timing, seen, state.supervisor);
  if (!known_velocity && state.supervisor.motors_on()) {
    latch(Fault::velocity_estimator, state.supervisor);
  }
  return sensed;
}

}  // namespace kerf
