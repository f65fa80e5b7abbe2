// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/servo/kinematics/rotation.hpp"
#include "controller/servo/kinematics/serial_arm.hpp"
#include "shared/wire/omni_constants.hpp"

namespace kerf {

/// Gimbal angles in rad from both wipers of each pot: gain * A / (A + B) + offset.
/// A pot that reads nothing (A + B = 0) counts as centred.
template <class N>
[[nodiscard]] constexpr std::array<typename N::Angle, 3> omni_gimbal(
    const std::array<std::uint32_t, 3>& wiper_a,
    const std::array<std::uint32_t, 3>& wiper_b) noexcept {
  using Angle = typename N::Angle;
  std::array<Angle, 3> angles{};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t sum = std::int64_t{wiper_a[i]} + wiper_b[i];
    if (sum == 0) continue;
    Angle ratio;
    if constexpr (N::kIsFixed) {
      constexpr int kBits = Angle::kFractionBits;
      ratio = Angle::from_wide(((std::int64_t{wiper_a[i]} << (kBits + 1)) / sum), kBits + 1);
    } else {
      ratio = Angle(static_cast<double>(wiper_a[i]) / static_cast<double>(sum));
    }
    angles[i] = Angle(omni::kGimbalSlopeRad[i]) * ratio + Angle(omni::kGimbalOffsetRad[i]);
  }
  return angles;
}

/// Orientation of the tool in the world: Ry(-q1) Rx(-q3) Ry(-yaw) Rx(pitch) Ry(roll). Identity is
/// a tool whose shaft points up. The gimbal's zero and signs follow the vendor's documents; they
/// were never compared with hardware.
template <class N>
[[nodiscard]] constexpr Rotation<N> omni_orientation(
    const SerialJoints<N>& q, const std::array<typename N::Angle, 3>& gimbal) noexcept {
  const Rotation<N> arm = compose<N>(rotation_y<N>(-q.turret), rotation_x<N>(-q.forearm));
  const Rotation<N> wrist = compose<N>(rotation_y<N>(-gimbal[0]), rotation_x<N>(gimbal[1]));
  return compose<N>(compose<N>(arm, wrist), rotation_y<N>(gimbal[2]));
}

}  // namespace kerf
