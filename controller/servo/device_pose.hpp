// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "controller/servo/device_report.hpp"
#include "controller/servo/kinematics/omni.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"

namespace kerf {

/// Where the device is, from one good report.
template <class N>
struct DevicePose {
  OmniPose<N> arm;
  DeviceVec<typename N::Real> tip_mm;
  Rotation<N> rotation;
  std::array<typename N::Angle, 3> gimbal{};  ///< yaw, pitch, roll
};

inline constexpr std::int32_t kRestCounts = 2;  ///< steps of an encoder that jitters at an edge

/// Follows the encoders over the wrap at 16 bits. After `dock_ticks` at rest in the inkwell the
/// counters start again from 0: that is the calibration. Returns whether it holds in this report.
inline bool follow_encoders(const DeviceReport& report, std::uint32_t dock_ticks,
                            EncoderState& encoders) noexcept {
  bool at_rest = report.docked;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto step = static_cast<std::int16_t>(report.encoder[i] - encoders.last[i]);
    constexpr std::int64_t kEnd = std::numeric_limits<std::int32_t>::max();  // either sign fits
    encoders.unwrapped[i] = static_cast<std::int32_t>(
        std::clamp(std::int64_t{encoders.unwrapped[i]} + step, -kEnd, kEnd));
    encoders.last[i] = report.encoder[i];
    at_rest = at_rest && step >= -kRestCounts && step <= kRestCounts;
  }
  encoders.rest_ticks = at_rest ? std::min(encoders.rest_ticks + 1, dock_ticks) : 0;
  const bool calibrated = encoders.rest_ticks >= dock_ticks;
  if (calibrated) encoders.unwrapped = {};
  return calibrated;
}

inline void follow_gimbal(const DeviceReport& report, GimbalFilter& filter) noexcept {
  auto& oldest = filter.ring[filter.next];
  for (std::size_t i = 0; i < 3; ++i) {
    filter.sum[i] += report.wiper_a[i] - std::uint32_t{oldest[i]};
    filter.sum[i + 3] += report.wiper_b[i] - std::uint32_t{oldest[i + 3]};
    oldest[i] = report.wiper_a[i];
    oldest[i + 3] = report.wiper_b[i];
  }
  filter.next = (filter.next + 1) % GimbalFilter::kSamples;
}

/// Forward kinematics of the filtered counts.
template <class N>
[[nodiscard]] DevicePose<N> device_pose(const ServoPlan<N>& plan, const EncoderState& encoders,
                                        const GimbalFilter& gimbal) noexcept {
  const auto joint = [&](std::size_t i, typename N::Angle dock) {
    return dock + angle_of_counts<N>(omni::kEncoderSign[i] * encoders.unwrapped[i]);
  };
  const OmniJoints<N> joints{joint(0, plan.dock.turret), joint(1, plan.dock.thigh),
                             joint(2, plan.dock.forearm)};
  const std::array<std::uint32_t, 3> a{gimbal.sum[0], gimbal.sum[1], gimbal.sum[2]};
  const std::array<std::uint32_t, 3> b{gimbal.sum[3], gimbal.sum[4], gimbal.sum[5]};
  DevicePose<N> pose;
  pose.arm = omni_pose(joints);
  pose.tip_mm = omni_tip<N>(pose.arm);
  pose.gimbal = omni_gimbal<N>(a, b);
  pose.rotation = omni_orientation<N>(joints, pose.gimbal);
  return pose;
}

}  // namespace kerf
