// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/servo/kinematics/forward_kinematics.hpp"
#include "controller/servo/kinematics/rotation.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// Three legs around the z axis that carry one grip without turning it: the Falcon, in the form of
/// Stamper's thesis. In the plane of a leg (u outward, w = z) the arm of length `crank_mm` turns by
/// t from u; from its end, the knee, a parallelogram reaches the grip:
///
///     knee = (hub + a cos t, a sin t)     D = |(u, w) - knee|     (D - h)^2 + (v + side)^2 = b^2
///
/// with v across the plane, h the hinges' share of the way and b the parallelogram's length.
template <class N>
struct DeltaArm {
  using Real = typename N::Real;
  Real hub_mm;            ///< r - c: of the crank's axis from the z axis, less that of the grip's
  Real crank_mm;          ///< a
  Real parallelogram_mm;  ///< b
  Real hinges_mm;         ///< h = d + e
  Real side_mm;           ///< f - s
  Real origin_depth_mm;   ///< the device's origin lies so far along z from the base
  std::array<SineCosine<N>, 3> azimuth;  ///< of the legs about z, from x
};

namespace delta {

/// Newton steps from the middle of the workspace. Each doubles the digits; five reach the last bit
/// everywhere in the workspace (tests/servo/delta_arm_test.cpp), one more is room.
inline constexpr int kSteps = 6;

/// a / b in the format of a unit vector.
template <class N>
[[nodiscard]] constexpr typename N::Unit ratio(typename N::Real a, typename N::Real b) noexcept {
  using Unit = typename N::Unit;
  if constexpr (N::kIsFixed) {
    if (b.raw() == 0) return Unit{};
    return Unit::from_raw(saturate_i32((std::int64_t{a.raw()} << Unit::kFractionBits) / b.raw()));
  } else {
    return a / b;
  }
}

/// One leg at a place of the grip: the direction of its parallelogram, and by how much the
/// parallelogram would be too long.
template <class N>
struct Leg {
  DeviceVec<typename N::Unit> rod;
  typename N::Real excess_mm;
};

template <class N>
[[nodiscard]] constexpr Leg<N> leg_at(const DeltaArm<N>& arm, const SineCosine<N>& azimuth,
                                      const SineCosine<N>& crank,
                                      DeviceVec<typename N::Real> grip_mm) noexcept {
  using Real = typename N::Real;
  using Unit = typename N::Unit;
  const Real out =
      multiply<Real>(azimuth.cosine, grip_mm.x) + multiply<Real>(azimuth.sine, grip_mm.y);
  const Real across = multiply<Real>(azimuth.cosine, grip_mm.y) -
                      multiply<Real>(azimuth.sine, grip_mm.x) + arm.side_mm;
  const Real from_knee = out - arm.hub_mm - multiply<Real>(crank.cosine, arm.crank_mm);
  const Real up_from_knee = grip_mm.z - multiply<Real>(crank.sine, arm.crank_mm);
  const Real distance = norm(DeviceVec<Real>{from_knee, Real(0), up_from_knee});
  const Real along = distance - arm.hinges_mm;
  const Real length = norm(DeviceVec<Real>{along, across, Real(0)});

  const Unit in_plane = ratio<N>(along, length);
  const Unit rod_out = in_plane * ratio<N>(from_knee, distance);
  const Unit rod_across = ratio<N>(across, length);
  return {{azimuth.cosine * rod_out - azimuth.sine * rod_across,
           azimuth.sine * rod_out + azimuth.cosine * rod_across,
           in_plane * ratio<N>(up_from_knee, distance)},
          length - arm.parallelogram_mm};
}

/// The vectors g_i with g_i . rod_j = 1 where i = j, else 0.
template <class N>
[[nodiscard]] constexpr std::array<DeviceVec<typename N::Ratio>, 3> dual_of(
    const std::array<Leg<N>, 3>& legs) noexcept {
  using Ratio = typename N::Ratio;
  using Rod = DeviceVec<typename N::Unit>;
  const auto cross = [](Rod a, Rod b) {
    return Rod{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  };
  const std::array<Rod, 3> crossed{cross(legs[1].rod, legs[2].rod), cross(legs[2].rod, legs[0].rod),
                                   cross(legs[0].rod, legs[1].rod)};
  const Rod first = legs[0].rod;
  const Ratio volume(first.x * crossed[0].x + first.y * crossed[0].y + first.z * crossed[0].z);
  std::array<DeviceVec<Ratio>, 3> dual;
  for (std::size_t i = 0; i < 3; ++i) {
    dual[i] = {Ratio(crossed[i].x) / volume, Ratio(crossed[i].y) / volume,
               Ratio(crossed[i].z) / volume};
  }
  return dual;
}

}  // namespace delta

/// Tip and Jacobian for three crank angles in rad, by Newton's method with a fixed number of steps.
/// Angles that no grip can have give some finite place (fixed point) or NaN (floating point).
template <class N>
[[nodiscard]] constexpr ForwardKinematics<N> delta_arm_pose(
    const DeltaArm<N>& arm, const std::array<typename N::Angle, 3>& angles) noexcept {
  using Real = typename N::Real;
  using Unit = typename N::Unit;
  std::array<SineCosine<N>, 3> crank;
  for (std::size_t i = 0; i < 3; ++i) crank[i] = sine_cosine<N>(angles[i]);

  DeviceVec<Real> grip{Real(0), Real(0), arm.origin_depth_mm};
  std::array<delta::Leg<N>, 3> legs;
  std::array<DeviceVec<typename N::Ratio>, 3> dual;
  for (int step = 0; step <= delta::kSteps; ++step) {
    for (std::size_t i = 0; i < 3; ++i) {
      legs[i] = delta::leg_at<N>(arm, arm.azimuth[i], crank[i], grip);
    }
    dual = delta::dual_of<N>(legs);
    if (step == delta::kSteps) break;  // the last round is for the Jacobian alone
    for (std::size_t i = 0; i < 3; ++i) {
      grip = grip - DeviceVec<Real>{multiply<Real>(dual[i].x, legs[i].excess_mm),
                                    multiply<Real>(dual[i].y, legs[i].excess_mm),
                                    multiply<Real>(dual[i].z, legs[i].excess_mm)};
    }
  }

  // A rod bears force along itself only: with f_i its force, F = SUM f_i rod_i, so f_i = g_i . F;
  // and it pulls its crank with the part of rod_i along the knee's motion.
  ForwardKinematics<N> pose;
  pose.tip_mm = {grip.x, grip.y, grip.z - arm.origin_depth_mm};
  for (std::size_t i = 0; i < 3; ++i) {
    const Unit out = arm.azimuth[i].cosine * legs[i].rod.x + arm.azimuth[i].sine * legs[i].rod.y;
    const Unit along_motion = crank[i].cosine * legs[i].rod.z - crank[i].sine * out;
    const Real arm_mm = multiply<Real>(along_motion, arm.crank_mm);
    pose.jacobian_t_mm.row[i] = {multiply<Real>(dual[i].x, arm_mm),
                                 multiply<Real>(dual[i].y, arm_mm),
                                 multiply<Real>(dual[i].z, arm_mm)};
  }
  return pose;
}

}  // namespace kerf
