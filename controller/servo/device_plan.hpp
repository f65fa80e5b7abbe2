// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "controller/servo/kinematics/delta_arm.hpp"
#include "controller/servo/kinematics/serial_arm.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {

/// Radians per encoder count, finer than Angle, so that a whole turn of counts is exact to the last
/// bit of it: in fixed point an integer with 40 fraction bits.
template <class N>
using AnglePerCount = std::conditional_t<N::kIsFixed, std::int64_t, double>;
inline constexpr int kAnglePerCountBits = 40;

/// One motor and its encoder.
template <class N>
struct JointPlan {
  typename N::Angle home_rad;          ///< where the count is 0
  AnglePerCount<N> angle_per_count{};  ///< signed: the encoder's sense
  typename N::Real counts_per_n_mm{};  ///< motor counts per torque, signed
};

/// Most readings of the gimbal that are summed: 20 ms at 8 kHz, the highest rate.
inline constexpr std::size_t kMaxGimbalSamples = 160;

/// Everything constant of the held device.
template <class N>
struct DevicePlan {
  Personality personality = Personality::omni;
  std::array<JointPlan<N>, 3> joints{};
  /// Encoders are absolute once the device is `homed`; else they count from the place where it was
  /// parked at rest.
  bool absolute_encoders = false;
  SerialArm<N> serial{};  ///< of the Omni and WoodenHaptics
  DeltaArm<N> delta{};    ///< of the Falcon

  std::size_t gimbal_samples = 1;  ///< in 20 ms, of a device with a gimbal

  bool motors_configured = false;
  std::int32_t motor_count_end = 0;  ///< motor counts lie within +- this
};

}  // namespace kerf
