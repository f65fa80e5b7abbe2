// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <numbers>

/// What is known of the Novint Falcon in numbers: geometry, encoders, motors.
///
/// mm, rad and counts. Frame of the device: x right, y up, z to the user; its origin lies on the
/// axis of the three legs, kOriginDepthMm in front of the plane of their hips. The letters are
/// those of Stamper's thesis on this kind of delta arm. One leg, in its own frame (u away from the
/// axis, v across, w = towards the user), with p the grip counted from the hips' plane:
///
///     (u, v, w) = Rz(-azimuth) p - (r, s, 0)
///     knee  = a (cos t1, sin t1) in the plane of u and w
///     shin  = from the knee over d + e + b sin t3 in that plane to (u + c, w)
///     cos t3 = (v + f) / b
///
/// t1 is the joint that is measured and driven.
///
/// Source: the open driver libnifalcon, which measured one device. Its count of zero is "about" 35
/// degrees, so the angle of zero differs between units.
namespace kerf::falcon {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kRadPerDegree = kPi / 180.0;

// Legs.
inline constexpr double kThighMm = 60.0;         ///< a
inline constexpr double kShinMm = 102.5;         ///< b
inline constexpr double kPlateOutMm = 14.43;     ///< c: centre of the grip to a shin, along u
inline constexpr double kShinEndMm = 11.25;      ///< d
inline constexpr double kKneeEndMm = 11.25;      ///< e
inline constexpr double kPlateAcrossMm = -25.0;  ///< f: the same along v
inline constexpr double kHipOutMm = 40.0;        ///< r
inline constexpr double kHipAcrossMm = -23.09;   ///< s
inline constexpr std::array<double, 3> kLegAzimuthRad{
    // about z, from x towards y
    105.0 * kRadPerDegree, -15.0 * kRadPerDegree, -135.0 * kRadPerDegree};
/// Device z = 0 is p.z = 125 mm: a ball of kReachMm around it has no pose near a singular one.
inline constexpr double kOriginDepthMm = 125.0;
inline constexpr double kReachMm = 55.0;

// Joint encoders: t1 = kZeroRad + kRadPerCount * count, once homed.
inline constexpr double kShaftMm = 14.25;       ///< motor shaft, where the encoder sits
inline constexpr double kThighWheelMm = 110.0;  ///< that it drives
inline constexpr int kShaftCountsPerRev = 4 * 320;
inline constexpr double kCountsPerRev = kShaftCountsPerRev * kThighWheelMm / kShaftMm;
inline constexpr double kRadPerCount = 2.0 * kPi / kCountsPerRev;
inline constexpr double kZeroRad = 35.0 * kRadPerDegree;

// Motors: signed counts. A positive one turns the thigh towards smaller t1 (the open driver negates
// J^T F). Torque per count is unknown: the open driver's factor of 1e4 would mean 0.1 N mm.
inline constexpr int kMotorCountMax = 4096;
inline constexpr int kMotorSign = -1;
inline constexpr double kOpenDriverNmmPerCount = 0.1;

// Sold as.
inline constexpr double kMaxForceN = 8.9;

// Packets.
inline constexpr std::size_t kPacketBytes = 16;  ///< both ways

}  // namespace kerf::falcon
