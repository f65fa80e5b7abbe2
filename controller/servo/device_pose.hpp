// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "controller/servo/device_plan.hpp"
#include "controller/servo/device_report.hpp"
#include "controller/servo/kinematics/omni_gimbal.hpp"
#include "controller/servo/servo_state.hpp"
#include "controller/servo/supervisor.hpp"

namespace kerf {

/// Where the device is, from one good report.
template <class N>
struct DevicePose {
  ForwardKinematics<N> arm;
  Rotation<N> rotation = identity_rotation<N>();
  std::array<typename N::Angle, 3> gimbal{};  ///< yaw, pitch, roll
};

/// An encoder that jitters at an edge. A rest that gives the counters their zero lets none go
/// farther than this from where it began; on a device that knows its zero, and that a hand holds
/// still, none goes farther from one report to the next.
inline constexpr std::int32_t kRestCounts = 2;

/// One tick without a fresh report. Where the servo is faster than the device the last report still
/// holds, and with it a rest, for as long as a force would be held.
inline void follow_silence(const SafetyTiming& timing, EncoderState& encoders) noexcept {
  encoders.silent_ticks += encoders.silent_ticks <= timing.hold_ticks ? 1U : 0U;
  const bool rests = encoders.rest_ticks > 0 && encoders.silent_ticks <= timing.hold_ticks;
  encoders.rest_ticks = rests ? std::min(encoders.rest_ticks + 1, timing.rest_ticks) : 0;
}

/// One tick of the encoders, followed over the wrap at 16 bits. Parked at rest for `rest_ticks` and
/// homed, the counters start again, from 0 or from the device's absolute counts: that is the
/// calibration. Returns whether it holds in this report; never in one that is not fresh.
inline bool follow_encoders(const DeviceReport& report, bool absolute, const SafetyTiming& timing,
                            EncoderState& encoders) noexcept {
  if (!report.fresh) {
    follow_silence(timing, encoders);
    return false;
  }
  encoders.silent_ticks = 0;
  bool at_rest = report.parked && report.homed;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto step = static_cast<std::int16_t>(report.encoder[i] - encoders.last[i]);
    constexpr std::int64_t kEnd = std::numeric_limits<std::int32_t>::max();  // either sign fits
    encoders.unwrapped[i] = static_cast<std::int32_t>(
        std::clamp(std::int64_t{encoders.unwrapped[i]} + step, -kEnd, kEnd));
    encoders.last[i] = report.encoder[i];
    const auto moved =
        absolute ? step : static_cast<std::int16_t>(report.encoder[i] - encoders.rest_from[i]);
    at_rest = at_rest && moved >= -kRestCounts && moved <= kRestCounts;
  }
  if (!at_rest) encoders.rest_from = report.encoder;
  encoders.rest_ticks = at_rest ? std::min(encoders.rest_ticks + 1, timing.rest_ticks) : 0;
  if (encoders.rest_ticks < timing.rest_ticks) return false;
  encoders.unwrapped = {};
  if (absolute) std::ranges::copy(report.encoder, encoders.unwrapped.begin());
  return true;
}

/// Takes a reading; `samples`, 1 to kMaxGimbalSamples, make up the sum.
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

/// Angle of `counts` encoder steps from home; at most 8 rad either way, where fixed saturates: what
/// lies beyond is no joint of a device, and no tip of it may leave the range of floats.
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

/// Forward kinematics of the filtered counts. A device without a gimbal never turns the tool.
template <class N>
[[nodiscard]] DevicePose<N> device_pose(const DevicePlan<N>& device, const EncoderState& encoders,
                                        const GimbalFilter& gimbal) noexcept {
  std::array<typename N::Angle, 3> angles;
  for (std::size_t i = 0; i < 3; ++i) {
    angles[i] = joint_angle(device.joints[i], encoders.unwrapped[i]);
  }
  DevicePose<N> pose;
  if (device.personality == Personality::falcon) {
    pose.arm = delta_arm_pose(device.delta, angles);
    return pose;
  }
  const SerialJoints<N> joints{angles[0], angles[1], angles[2]};
  pose.arm = serial_arm_pose(device.serial, joints);
  if (device.personality == Personality::omni) {
    pose.gimbal = omni_gimbal<N>({gimbal.sum[0], gimbal.sum[1], gimbal.sum[2]},
                                 {gimbal.sum[3], gimbal.sum[4], gimbal.sum[5]});
    pose.rotation = omni_orientation<N>(joints, pose.gimbal);
  }
  return pose;
}

}  // namespace kerf
