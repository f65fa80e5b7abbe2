// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

/// What is known of the PHANTOM Omni in numbers: scales, link lengths, the inkwell pose.
///
/// mm, rad and counts. Frame of the device: x right, y up, z to the user; the point is the gimbal
/// centre. Joints are absolute: q1 turret, q2 thigh, q3 forearm against the base (its motor and its
/// encoder work through a parallel linkage). With r = L1 cos q2 + L2 sin q3:
///
///     x = -sin q1 r      y = L1 sin q2 - L2 cos q3 + Cy      z = cos q1 r - Cz
///
/// Link offsets and the inkwell pose differ between units: they are defaults for a configuration,
/// not truths about one device.
namespace kerf::omni {

inline constexpr double kPi = 3.14159265358979323846;

inline constexpr std::uint32_t kVendorOui = 0x000B99;  ///< SensAble, in the configuration ROM

// Links.
inline constexpr double kUpperLinkMm = 133.35;  ///< L1
inline constexpr double kForearmMm = 133.35;    ///< L2
inline constexpr double kOriginHeightMm =
    23.35;  ///< Cy: the frame lies this far below the shoulder
inline constexpr double kOriginDepthMm = 168.35;  ///< Cz: and this far in front of it
inline constexpr std::array<double, 3> kDockRad{0.0, 0.23, -0.37};  ///< q in the inkwell

// Joint encoders: q_i = dock_i + sign_i * kRadPerCount * (count_i - count in the inkwell).
inline constexpr int kCountsPerRev = 15000;
inline constexpr double kRadPerCount = 2.0 * kPi / kCountsPerRev;
inline constexpr std::array<int, 3> kEncoderSign{1, -1, 1};

// Gimbal: with r = A / (A + B), angle_i = slope_i * r + offset_i; order yaw, pitch, roll.
inline constexpr std::array<double, 3> kGimbalSlopeRad{5.48, -5.28, 4.76};
inline constexpr std::array<double, 3> kGimbalOffsetRad{-2.74, 2.64, -2.38};
inline constexpr int kPotNoiseBits = 5;  ///< the lowest bits of each pot are noise

// Motors: 12 bits, offset binary.
inline constexpr int kMotorZero = 0x7FF;  ///< DAC word of no torque
inline constexpr int kMotorWordMax = 0xFFF;
inline constexpr int kMotorCountMin = -kMotorZero;
inline constexpr int kMotorCountMax = kMotorWordMax - kMotorZero;

// Isochronous packets.
inline constexpr std::size_t kCommandBytes = 16;  ///< host to device
inline constexpr std::size_t kReportBytes = 44;   ///< device to host
inline constexpr int kBusCyclesPerSecond = 8000;

}  // namespace kerf::omni
