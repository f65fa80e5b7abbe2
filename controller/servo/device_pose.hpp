// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

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
};

/// Follows the encoders over the wrap at 16 bits. In the inkwell the counters start again from 0:
/// that is the calibration.
inline void follow_encoders(const DeviceReport& report, EncoderState& encoders) noexcept {
  for (std::size_t i = 0; i < 3; ++i) {
    const auto step = static_cast<std::int16_t>(report.encoder[i] - encoders.last[i]);
    encoders.unwrapped[i] =
        report.docked ? 0 : saturate_i32(std::int64_t{encoders.unwrapped[i]} + step);
    encoders.last[i] = report.encoder[i];
  }
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
  pose.rotation = omni_orientation<N>(joints, omni_gimbal<N>(a, b));
  return pose;
}

}  // namespace kerf
