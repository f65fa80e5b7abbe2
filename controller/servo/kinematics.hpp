// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/wire/omni.hpp"

// From joint angles to the tip, its Jacobian and the orientation of the tool. No libm.

namespace kerf {

template <class N>
struct SineCosine {
  typename N::Unit sine, cosine;
};

/// Sine and cosine by their Taylor series in nested form. No libm: its last bit differs between
/// versions.
///
/// Joints stay below 1.8 rad. Angles beyond 2 rad are reduced by half turns, pi each: a gimbal near
/// its ends, and counts that jump or have no zero yet, up to the 8 rad where `Angle` ends. Without
/// that the series would give a matrix that is no rotation, and stretch the tool.
///
/// Truncation: 2^19/19! = 4.3e-12 and 2^18/18! = 4.1e-11; fixed point adds at most 3e-8, which is
/// 4e-6 mm at an arm of 133 mm.
template <class N>
[[nodiscard]] constexpr SineCosine<N> sine_cosine(typename N::Angle angle) noexcept {
  using A = typename N::Angle;
  constexpr int kTerms = 8;
  constexpr int kMostHalfTurns = 2;  // 8 - 2 pi < 2
  const A one(1), pi = static_cast<A>(std::numbers::pi);
  bool flipped = false;
  for (int i = 0; i < kMostHalfTurns && (angle > A(2) || angle < A(-2)); ++i) {
    angle += angle > A(0) ? -pi : pi;
    flipped = !flipped;
  }
  const A square = angle * angle;
  A sine = one;
  A cosine = one;
  // sin x = x (1 - x^2/(2 3) (1 - x^2/(4 5) (...))),  cos x = 1 - x^2/(1 2) (1 - x^2/(3 4) (...))
  for (int k = kTerms; k >= 1; --k) {
    sine = one - square * A(1.0 / ((2 * k) * (2 * k + 1))) * sine;
    cosine = one - square * A(1.0 / ((2 * k - 1) * (2 * k))) * cosine;
  }
  sine = angle * sine;
  return {typename N::Unit(flipped ? -sine : sine), typename N::Unit(flipped ? -cosine : cosine)};
}

/// Orientation of the tool: takes a direction of its own frame to the world.
template <class N>
using Rotation = Transform<typename N::Unit, WorldSpace, ToolSpace>;

template <class N>
[[nodiscard]] constexpr Rotation<N> identity_rotation() noexcept {
  using U = typename N::Unit;
  return {{{{U(1), U(0), U(0)}, {U(0), U(1), U(0)}, {U(0), U(0), U(1)}}}};
}

/// Right-handed rotation about the x axis.
template <class N>
[[nodiscard]] constexpr Rotation<N> rotation_x(typename N::Angle angle) noexcept {
  using U = typename N::Unit;
  const auto [s, c] = sine_cosine<N>(angle);
  return {{{{U(1), U(0), U(0)}, {U(0), c, -s}, {U(0), s, c}}}};
}

/// Right-handed rotation about the y axis.
template <class N>
[[nodiscard]] constexpr Rotation<N> rotation_y(typename N::Angle angle) noexcept {
  using U = typename N::Unit;
  const auto [s, c] = sine_cosine<N>(angle);
  return {{{{c, U(0), s}, {U(0), U(1), U(0)}, {-s, U(0), c}}}};
}

/// The rotation by `b`, then by `a`.
template <class N>
[[nodiscard]] constexpr Rotation<N> compose(const Rotation<N>& a, const Rotation<N>& b) noexcept {
  Rotation<N> product;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      product.row[i][j] =
          a.row[i][0] * b.row[0][j] + a.row[i][1] * b.row[1][j] + a.row[i][2] * b.row[2][j];
    }
  }
  return product;
}

/// Maps a force in N at the tip to the joint torques in N mm that produce it: J^T, one row per
/// joint, entries in mm.
template <class N>
using JacobianTransposed = Transform<typename N::Real, JointSpace, DeviceSpace>;

/// The tip in device mm (x right, y up, z to the user) and J^T there.
template <class N>
struct ForwardKinematics {
  DeviceVec<typename N::Real> tip_mm;
  JacobianTransposed<N> jacobian_t_mm;
  bool closes = true;  ///< false: no position of the arm has these angles
};

// The serial arm: a turret that carries a thigh and a forearm in one plane. Omni and WoodenHaptics.

/// Dimensions of a serial arm.
template <class N>
struct SerialArm {
  typename N::Real thigh_mm, forearm_mm;  ///< link lengths
  typename N::Real origin_height_mm;      ///< of the shoulder above the device's origin
  typename N::Real origin_depth_mm;       ///< of the shoulder behind it
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

/// Gimbal angles of an Omni in rad from both wipers of each pot: gain * A / (A + B) + offset.
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

/// Orientation of the tool of an Omni in the world: Ry(-q1) Rx(-q3) Ry(-yaw) Rx(pitch) Ry(roll).
/// Identity is a tool whose shaft points up. The gimbal's zero and signs follow the vendor's
/// documents; they have not been compared with hardware.
template <class N>
[[nodiscard]] constexpr Rotation<N> omni_orientation(
    const SerialJoints<N>& q, const std::array<typename N::Angle, 3>& gimbal) noexcept {
  const Rotation<N> arm = compose<N>(rotation_y<N>(-q.turret), rotation_x<N>(-q.forearm));
  const Rotation<N> wrist = compose<N>(rotation_y<N>(-gimbal[0]), rotation_x<N>(gimbal[1]));
  return compose<N>(compose<N>(arm, wrist), rotation_y<N>(gimbal[2]));
}

// The delta arm: three legs around the z axis that carry one grip without rotating it. Falcon.

/// In the form of Stamper's thesis. In the plane of a leg (u outward, w = z) the crank of length
/// `crank_mm` is rotated by t from u; from its end, the knee, a parallelogram reaches the grip:
///
///     knee = (hub + a cos t, a sin t)     D = |(u, w) - knee|     (D - h)^2 + (v + side)^2 = b^2
///
/// with v across the plane, h the length of the hinges and b the parallelogram's length.
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

/// Largest error of a leg's length at the end. A count of an encoder moves a knee by 0.038 mm; in
/// the workspace less than 0.002 mm is left (tests/servo/delta_arm_test.cpp).
inline constexpr double kMostExcessMm = 1.0 / 32;
/// No crank turns as far, either way: beyond it lies the same pose by a whole turn more.
inline constexpr double kMostCrankRad = 3.0;

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

/// One leg at a position of the grip: the direction of its parallelogram, and the error of its
/// length.
template <class N>
struct Leg {
  DeviceVec<typename N::Unit> rod;
  typename N::Real excess_mm;
  typename N::Real along_mm;  ///< of the parallelogram in the leg's plane; not above 0: folded
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
          length - arm.parallelogram_mm,
          along};
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
/// Angles that no grip can have give any position, or NaN in floating point, and do not close: the
/// legs are too long or too short there, or a knee is bent the other way.
template <class N>
[[nodiscard]] constexpr ForwardKinematics<N> delta_arm_pose(
    const DeltaArm<N>& arm, const std::array<typename N::Angle, 3>& angles) noexcept {
  using Angle = typename N::Angle;
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
    const Real excess_mm = legs[i].excess_mm;
    constexpr Real kMost = Real(delta::kMostExcessMm);
    constexpr Angle kEnd(delta::kMostCrankRad);
    pose.closes = pose.closes && along_motion > Unit(0) && legs[i].along_mm > Real(0) &&
                  excess_mm <= kMost && excess_mm >= -kMost && angles[i] <= kEnd &&
                  angles[i] >= -kEnd;
    pose.jacobian_t_mm.row[i] = {multiply<Real>(dual[i].x, arm_mm),
                                 multiply<Real>(dual[i].y, arm_mm),
                                 multiply<Real>(dual[i].z, arm_mm)};
  }
  return pose;
}

// Cartesian devices: the vendor's side has done the kinematics.

/// The tip is what was reported, and a motor is an axis of the device's frame: J^T is the identity,
/// so that a "torque" is the force along that axis, in N.
template <class N>
[[nodiscard]] constexpr ForwardKinematics<N> cartesian_pose(
    DeviceVec<typename N::Real> tip_mm) noexcept {
  using Real = typename N::Real;
  ForwardKinematics<N> pose;
  pose.tip_mm = tip_mm;
  pose.jacobian_t_mm.row = {
      {{Real(1), Real(0), Real(0)}, {Real(0), Real(1), Real(0)}, {Real(0), Real(0), Real(1)}}};
  return pose;
}

/// The rotation by a quaternion x, y, z, w of any length. It divides by the squared length at the
/// end, so that integers are exact until then. The identity for a quaternion of zeros.
template <class N>
[[nodiscard]] constexpr Rotation<N> rotation_of(
    const std::array<std::int16_t, 4>& quaternion) noexcept {
  using Unit = typename N::Unit;
  const std::int64_t x = quaternion[0], y = quaternion[1], z = quaternion[2], w = quaternion[3];
  const std::int64_t square = x * x + y * y + z * z + w * w;  // below 2^32
  if (square == 0) return identity_rotation<N>();
  const auto over_square = [&](std::int64_t part) {
    if constexpr (N::kIsFixed) {
      // |part| <= square, so the quotient is at most 1.
      constexpr int kBits = Unit::kFractionBits;
      static_assert(kBits <= 30);
      return Unit::from_raw(saturate_i32(part * (std::int64_t{1} << kBits) / square));
    } else {
      return Unit(static_cast<double>(part) / static_cast<double>(square));
    }
  };
  return {{{{over_square(w * w + x * x - y * y - z * z), over_square(2 * (x * y - w * z)),
             over_square(2 * (x * z + w * y))},
            {over_square(2 * (x * y + w * z)), over_square(w * w - x * x + y * y - z * z),
             over_square(2 * (y * z - w * x))},
            {over_square(2 * (x * z - w * y)), over_square(2 * (y * z + w * x)),
             over_square(w * w - x * x - y * y + z * z)}}}};
}

}  // namespace kerf
