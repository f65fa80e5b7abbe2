// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "shared/numeric/vec.hpp"
#include "shared/wire/omni.hpp"

/// Angles and transform of a Touch from its pose, and forces from joint torques.
///
/// Positions: the pose with all joints at 0 is (0, -110, -35) mm with both links 133.35 mm long, so
/// x = -s1 r, y = L s2 - L c3 + 23.35, z = c1 r - 168.35 with r = L c2 + L s3 (joint 3 counts
/// against the base). The chain of the wrist, Ry(-j1) Rx(-j3) Ry(g1) Rx(-g2) Rz(-g3), comes from
/// the drawing code of a client and was never checked on hardware.
namespace kerf::hd {

using Matrix3 = std::array<std::array<double, 3>, 3>;  ///< row, column
using Angles = std::array<double, 3>;                  ///< rad
using Transform16 = std::array<double, 16>;            ///< column by column

inline constexpr double kLinkMm = 133.35;
inline constexpr double kShoulderYMm = 23.35;
inline constexpr double kShoulderZMm = -168.35;

[[nodiscard]] inline Matrix3 product(const Matrix3& a, const Matrix3& b) noexcept {
  Matrix3 c{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k) c[i][j] += a[i][k] * b[k][j];
    }
  }
  return c;
}

[[nodiscard]] inline Matrix3 about_x(double angle) noexcept {
  const double c = std::cos(angle), s = std::sin(angle);
  return {{{1, 0, 0}, {0, c, -s}, {0, s, c}}};
}
[[nodiscard]] inline Matrix3 about_y(double angle) noexcept {
  const double c = std::cos(angle), s = std::sin(angle);
  return {{{c, 0, s}, {0, 1, 0}, {-s, 0, c}}};
}
[[nodiscard]] inline Matrix3 about_z(double angle) noexcept {
  const double c = std::cos(angle), s = std::sin(angle);
  return {{{c, -s, 0}, {s, c, 0}, {0, 0, 1}}};
}

/// The rotation of the transform for kerf's orientation of the tool (x, y, z, w). kerf's shaft
/// points from the tip along +y of the tool, HD's along +z of the transform: R_hd = R_tool Rx(-90).
[[nodiscard]] inline Matrix3 stylus_rotation(const std::array<double, 4>& q) noexcept {
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  const Matrix3 tool{{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                      {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                      {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}};
  constexpr Matrix3 kShaft{{{1, 0, 0}, {0, 0, 1}, {0, -1, 0}}};  // Rx(-90 degrees), exact
  return product(tool, kShaft);
}

[[nodiscard]] inline Transform16 transform_of(const Matrix3& r, DeviceVec<double> p_mm) noexcept {
  return {r[0][0], r[1][0], r[2][0], 0, r[0][1], r[1][1], r[2][1], 0,
          r[0][2], r[1][2], r[2][2], 0, p_mm.x,  p_mm.y,  p_mm.z,  1};
}

/// Turret (left +), thigh (up +), shin (up +, against the base). A position that no joints reach
/// has the angles of the nearest stretch.
[[nodiscard]] inline Angles joint_angles(DeviceVec<double> p_mm) noexcept {
  const double ahead = p_mm.z - kShoulderZMm;
  const double r = std::hypot(p_mm.x, ahead), h = p_mm.y - kShoulderYMm;
  // Two links of one length: their mean direction halves the angle between them.
  const double reach = std::min(std::hypot(r, h) / (2 * kLinkMm), 1.0);
  const double elevation = std::atan2(h, r), half = std::acos(reach);
  // The thigh at +half above the line to the tip, the shin below it; j3 counts from straight down.
  const double half_pi = std::acos(0.0);
  return {std::atan2(-p_mm.x, ahead), elevation + half, elevation - half + half_pi};
}

[[nodiscard]] inline Matrix3 wrist_rotation(const Angles& joints, const Angles& gimbal) noexcept {
  const Matrix3 arm = product(about_y(-joints[0]), about_x(-joints[2]));
  return product(product(arm, about_y(gimbal[0])),
                 product(about_x(-gimbal[1]), about_z(-gimbal[2])));
}

/// The rotation of the stylus as seen from the end of an arm with these joints.
[[nodiscard]] inline Matrix3 wrist_frame(const Matrix3& rotation, const Angles& joints) noexcept {
  return product(product(about_x(joints[2]), about_y(joints[0])), rotation);
}

/// The gimbal angles (right +, up -, clockwise +) of a rotation in the frame of the wrist; pitch
/// within a quarter turn, where it jumps from one end to the other.
[[nodiscard]] inline Angles angles_of(const Matrix3& m) noexcept {
  // Ry(a) Rx(b) Rz(c) has sin b = -m12, tan a = m02 / m22, tan c = m10 / m11.
  return {std::atan2(m[0][2], m[2][2]), std::asin(std::clamp(m[1][2], -1.0, 1.0)),
          -std::atan2(m[1][0], m[1][1])};
}

/// kerf's orientation of the tool (x, y, z, w) that these joints and gimbal angles give it: the
/// inverse of `stylus_rotation` of `wrist_rotation`.
[[nodiscard]] inline std::array<double, 4> tool_orientation(const Angles& joints,
                                                            const Angles& gimbal) noexcept {
  std::array<double, 4> q{0, 0, 0, 1};
  const auto turn = [&](std::size_t axis, double angle) {  // about an axis of the turned frame
    const double c = std::cos(angle / 2), s = std::sin(angle / 2);
    const std::size_t next = (axis + 1) % 3, last = (axis + 2) % 3;
    const std::array<double, 4> p = q;
    q[axis] = p[axis] * c + p[3] * s;
    q[next] = p[next] * c + p[last] * s;
    q[last] = p[last] * c - p[next] * s;
    q[3] = p[3] * c - p[axis] * s;
  };
  turn(1, -joints[0]);
  turn(0, -joints[2]);
  turn(1, gimbal[0]);
  turn(0, -gimbal[1]);
  turn(2, -gimbal[2]);
  turn(0, std::acos(0.0));  // from the stylus to the tool
  return q;
}

/// Six counts as the encoders have them: the joints, 0 in the inkwell, with the scale and the signs
/// of the Omni's; yaw, pitch and roll in 12 bits about the middle, of 0.0735 degrees by a client.
[[nodiscard]] inline std::array<double, 6> encoder_counts(const Angles& joints,
                                                          const Angles& gimbal) noexcept {
  constexpr double kGimbalMiddle = 2048, kGimbalRad = 0.0735 * omni::kPi / 180;
  std::array<double, 6> counts{};
  for (std::size_t i = 0; i < 3; ++i) {
    counts[i] = omni::kEncoderSign[i] * std::round(joints[i] / omni::kRadPerCount);
    counts[3 + i] = kGimbalMiddle + std::round(gimbal[i] / kGimbalRad);
  }
  return counts;
}

/// The joint torques in N mm, or mNm, for a force in N at the tip: J^T f.
[[nodiscard]] inline Angles torques_of_force(const Angles& joints,
                                             DeviceVec<double> force_n) noexcept {
  const double c1 = std::cos(joints[0]), s1 = std::sin(joints[0]);
  const double c2 = std::cos(joints[1]), s2 = std::sin(joints[1]);
  const double c3 = std::cos(joints[2]), s3 = std::sin(joints[2]);
  const double side = -c1 * force_n.x - s1 * force_n.z, ahead = -s1 * force_n.x + c1 * force_n.z;
  return {kLinkMm * (c2 + s3) * side, kLinkMm * (c2 * force_n.y - s2 * ahead),
          kLinkMm * (s3 * force_n.y + c3 * ahead)};
}

/// The force in N at the tip for joint torques in mNm: solves J^T f = torque. At a singular pose 0.
[[nodiscard]] inline DeviceVec<double> force_of_torques(const Angles& joints,
                                                        const Angles& torque_mnm) noexcept {
  const double c1 = std::cos(joints[0]), s1 = std::sin(joints[0]);
  const double c2 = std::cos(joints[1]), s2 = std::sin(joints[1]);
  const double c3 = std::cos(joints[2]), s3 = std::sin(joints[2]);
  const double r = kLinkMm * (c2 + s3);
  // Columns of J: turret moves along t = (-c1, 0, -s1), thigh and shin in the plane of u, y with
  // u = (-s1, 0, c1).
  const double det = kLinkMm * kLinkMm * (-s2 * s3 - c2 * c3);
  if (std::abs(r) < 1e-6 || std::abs(det) < 1e-6) return {};
  const double side = torque_mnm[0] / r;
  const double ahead = kLinkMm * (torque_mnm[1] * s3 - torque_mnm[2] * c2) / det;
  const double up = kLinkMm * (-s2 * torque_mnm[2] - c3 * torque_mnm[1]) / det;
  return {-c1 * side - s1 * ahead, up, -s1 * side + c1 * ahead};
}

}  // namespace kerf::hd
