// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/servo/kinematics/rotation.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/wire/omni_constants.hpp"

namespace kerf {

/// Joint angles of the Omni in rad: turret, thigh, and the forearm measured against the base, since
/// the third motor drives it through a parallel linkage. Forearm direction: (sin q3, -cos q3) in
/// the plane of the arm.
template <class N>
struct OmniJoints {
  typename N::Angle turret, thigh, forearm;
};

/// Sines and cosines of the joints, worked out once per tick and used by pose and torque.
template <class N>
struct OmniPose {
  SineCosine<N> turret, thigh, forearm;
  typename N::Real reach_mm;  ///< horizontal distance of the tip from the turret axis
};

/// Angle of `counts` encoder steps, exact to the last bit of Angle.
template <class N>
[[nodiscard]] constexpr typename N::Angle angle_of_counts(std::int32_t counts) noexcept {
  constexpr double kRadPerCount = omni::kRadPerCount;
  if constexpr (N::kIsFixed) {
    constexpr int kBits = 40;
    constexpr auto kScaled = static_cast<std::int64_t>(kRadPerCount * (std::int64_t{1} << kBits));
    return N::Angle::from_wide(counts * kScaled, kBits);
  } else {
    return typename N::Angle(kRadPerCount * counts);
  }
}

template <class N>
[[nodiscard]] constexpr OmniPose<N> omni_pose(const OmniJoints<N>& q) noexcept {
  using Real = typename N::Real;
  OmniPose<N> pose{sine_cosine<N>(q.turret), sine_cosine<N>(q.thigh), sine_cosine<N>(q.forearm),
                   Real{}};
  pose.reach_mm = multiply<Real>(pose.thigh.cosine, Real(omni::kUpperLinkMm)) +
                  multiply<Real>(pose.forearm.sine, Real(omni::kForearmMm));
  return pose;
}

/// Tip (gimbal centre) in device mm: x right, y up, z to the user.
template <class N>
[[nodiscard]] constexpr DeviceVec<typename N::Real> omni_tip(const OmniPose<N>& p) noexcept {
  using Real = typename N::Real;
  return {-multiply<Real>(p.turret.sine, p.reach_mm),
          multiply<Real>(p.thigh.sine, Real(omni::kUpperLinkMm)) -
              multiply<Real>(p.forearm.cosine, Real(omni::kForearmMm)) +
              Real(omni::kOriginHeightMm),
          multiply<Real>(p.turret.cosine, p.reach_mm) - Real(omni::kOriginDepthMm)};
}

/// Motor torques in N mm for a force in N at the tip: tau = J^T F, with
///   J = [-c1 r, s1 L1 s2, -s1 L2 c3; 0, L1 c2, L2 s3; -s1 r, -c1 L1 s2, c1 L2 c3].
template <class N>
[[nodiscard]] constexpr JointVec<typename N::Real> omni_torque(
    const OmniPose<N>& p, DeviceVec<typename N::Real> force_n) noexcept {
  using Real = typename N::Real;
  // Force along the arm (outward) and across it, in the turret's frame.
  const Real outward =
      multiply<Real>(p.turret.cosine, force_n.z) - multiply<Real>(p.turret.sine, force_n.x);
  const Real across =
      -multiply<Real>(p.turret.cosine, force_n.x) - multiply<Real>(p.turret.sine, force_n.z);
  return {across * p.reach_mm,
          Real(omni::kUpperLinkMm) *
              (multiply<Real>(p.thigh.cosine, force_n.y) - multiply<Real>(p.thigh.sine, outward)),
          Real(omni::kForearmMm) * (multiply<Real>(p.forearm.sine, force_n.y) +
                                    multiply<Real>(p.forearm.cosine, outward))};
}

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
    const OmniJoints<N>& q, const std::array<typename N::Angle, 3>& gimbal) noexcept {
  const Rotation<N> arm = compose<N>(rotation_y<N>(-q.turret), rotation_x<N>(-q.forearm));
  const Rotation<N> wrist = compose<N>(rotation_y<N>(-gimbal[0]), rotation_x<N>(gimbal[1]));
  return compose<N>(compose<N>(arm, wrist), rotation_y<N>(gimbal[2]));
}

}  // namespace kerf
