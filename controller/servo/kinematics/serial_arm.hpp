// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/servo/kinematics/forward_kinematics.hpp"
#include "controller/servo/kinematics/rotation.hpp"

namespace kerf {

/// A turret that carries a thigh and a forearm in one plane: the Omni and WoodenHaptics.
template <class N>
struct SerialArm {
  typename N::Real thigh_mm, forearm_mm;  ///< link lengths
  typename N::Real origin_height_mm;      ///< the device's origin lies so far below the shoulder
  typename N::Real origin_depth_mm;       ///< and so far in front of it
};

/// Joint angles in rad: turret (left positive), thigh above the horizontal, and the forearm
/// measured against the base, because its motor and encoder work through a parallel linkage.
/// Forearm direction: (sin, -cos) in the plane of the arm.
template <class N>
struct SerialJoints {
  typename N::Angle turret, thigh, forearm;
};

/// With r = L1 cos q2 + L2 sin q3:
///
///     x = -sin q1 r     y = L1 sin q2 - L2 cos q3 + Cy     z = cos q1 r - Cz
///
/// and J, rows x, y, z and columns q1, q2, q3:
///
///     [-c1 r, s1 L1 s2, -s1 L2 c3;   0, L1 c2, L2 s3;   -s1 r, -c1 L1 s2, c1 L2 c3]
template <class N>
[[nodiscard]] constexpr ForwardKinematics<N> serial_arm_pose(const SerialArm<N>& arm,
                                                             const SerialJoints<N>& q) noexcept {
  using Real = typename N::Real;
  const SineCosine<N> turret = sine_cosine<N>(q.turret);
  const SineCosine<N> thigh = sine_cosine<N>(q.thigh);
  const SineCosine<N> forearm = sine_cosine<N>(q.forearm);
  const Real thigh_out = multiply<Real>(thigh.cosine, arm.thigh_mm);
  const Real thigh_up = multiply<Real>(thigh.sine, arm.thigh_mm);
  const Real forearm_out = multiply<Real>(forearm.sine, arm.forearm_mm);
  const Real forearm_down = multiply<Real>(forearm.cosine, arm.forearm_mm);
  const Real reach = thigh_out + forearm_out;

  ForwardKinematics<N> pose;
  pose.tip_mm = {-multiply<Real>(turret.sine, reach),
                 thigh_up - forearm_down + arm.origin_height_mm,
                 multiply<Real>(turret.cosine, reach) - arm.origin_depth_mm};
  pose.jacobian_t_mm.row = {
      {{-multiply<Real>(turret.cosine, reach), Real(0), -multiply<Real>(turret.sine, reach)},
       {multiply<Real>(turret.sine, thigh_up), thigh_out, -multiply<Real>(turret.cosine, thigh_up)},
       {-multiply<Real>(turret.sine, forearm_down), forearm_out,
        multiply<Real>(turret.cosine, forearm_down)}}};
  return pose;
}

}  // namespace kerf
