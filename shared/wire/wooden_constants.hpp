// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>

/// What is known of the WoodenHaptics arm (open hardware) in numbers: links, capstans, motors, USB.
///
/// mm, rad and counts. Frame of the device: x right, y up, z to the user (the makers' y, z, x).
/// Angles are absolute: A turns the arm about the vertical, to the right; B leans the upper link
/// out from the vertical; C lifts the forearm from straight down, outwards (its motor works through
/// a parallel linkage). With r = Lb sin B + Lc sin C:
///
///     x = sin A r      y = Ln + Lb cos B - Lc cos C - Cy      z = cos A r - Cz
///
/// The same structure as the Omni's, with A = -q1, B = pi/2 - q2, C = q3. Source: the makers'
/// haptikfabriken API; their figures are for one build of plans that anybody may change.
namespace kerf::wooden {

inline constexpr double kPi = std::numbers::pi;

// Links.
inline constexpr double kShoulderHeightMm = 80.0;  ///< Ln
inline constexpr double kUpperLinkMm = 205.0;      ///< Lb
inline constexpr double kForearmMm = 245.0;        ///< Lc
inline constexpr double kOriginHeightMm = 80.0;    ///< Cy: the frame lies this far above the base
inline constexpr double kOriginDepthMm = 220.0;    ///< Cz: and this far in front of it

// Motors and their encoders drive the bodies by capstans: angle = kRadPerCount[i] * count.
inline constexpr int kCountsPerRev = 2000;  ///< of the motor
inline constexpr double kCapstanMm = 10.0;  ///< diameter
inline constexpr std::array<double, 3> kBodyMm{160.0, 120.0, 120.0};
inline constexpr std::array<double, 3> kRadPerCount{
    2.0 * kPi / kCountsPerRev * (kCapstanMm / kBodyMm[0]),
    2.0 * kPi / kCountsPerRev*(kCapstanMm / kBodyMm[1]),
    2.0 * kPi / kCountsPerRev*(kCapstanMm / kBodyMm[2])};
/// Of a, b, c in the pose in which the arm is calibrated: A = B = 0, C = pi/2.
inline constexpr std::array<std::int16_t, 3> kHomeCounts{0, 0, 6000};

/// Torque of a motor, N mm per A, by the plans of 2015. Positive current raises the count.
inline constexpr std::array<double, 3> kTorqueNmmPerA2015{25.9, 25.9, 25.9};
inline constexpr int kMaxMilliamps = 2000;        ///< cap of the makers' host
inline constexpr int kAmplifierMilliamps = 3000;  ///< at full duty of the firmware

/// The makers' limit.
inline constexpr double kMaxForceN = 5.0;

/// Without a report of the host for so long the firmware switches the amplifiers off.
inline constexpr double kWatchdogS = 0.5;

// USB. mbed firmware: 14 bytes both ways; Teensy raw HID: 64 bytes both ways, the first 14 used.
inline constexpr std::uint16_t kMbedVendorId = 0x1234;
inline constexpr std::uint16_t kMbedProductId = 0x0006;
inline constexpr std::uint16_t kTeensyVendorId = 0x16C0;
inline constexpr std::uint16_t kTeensyProductId = 0x0486;
inline constexpr std::uint16_t kUsagePage = 0xFFAB;
inline constexpr std::uint16_t kUsage = 0x0200;
inline constexpr std::size_t kPacketBytes = 14;
inline constexpr std::size_t kLongPacketBytes = 64;
/// Of the only report each way; hidraw wants it before the packet on writing, and gives none back.
inline constexpr std::uint8_t kReportId = 0;

}  // namespace kerf::wooden
