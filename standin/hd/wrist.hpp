// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "standin/hd/touch_kinematics.hpp"

/// The wrist of the stand-in's Touch: three joints with end stops.
namespace kerf::hd {

/// Gimbal angles that follow the stylus as the emulated hand holds it: within their range, and no
/// faster than kFastestRadPerS. The stylus stops where the wrist does: its transform is that of
/// these angles. One thread at a time; nothing allocates or throws.
///
/// A decomposition of the orientation alone would not do: upright above a forearm that hangs down,
/// as in the inkwell, the stylus is parallel to the first axis, which then has no angle.
class Wrist {
 public:
  /// Yaw and roll: the narrower of two sources, the joint limits of a client's robot model (4.9 rad
  /// in all, +-2.58) and the ends of the potentiometers (+-2.74, +-2.38). Pitch: the wider of two
  /// spans that clients have (2.25, 2.46), about the middle of the potentiometer.
  static constexpr Angles kMostRad{2.45, 1.23, 2.38};
  /// A guided hand of the emulator turns by 6 rad/s at most; at the end of the pitch the yaw needs
  /// 1 / cos(1.23) = 3 times that.
  static constexpr double kFastestRadPerS = 18;

  /// The arm has come to `joints` and the hand turns the stylus to `rotation`, `dt_s` after the
  /// last call. The first call puts the wrist there at once.
  void follow(const Matrix3& rotation, const Angles& joints, double dt_s) noexcept {
    const Matrix3 wanted = wrist_frame(rotation, joints);
    const Angles goal = reachable(wanted, is_placed_ ? kSweeps : kFirstSweeps);
    double farthest = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      farthest = std::max(farthest, std::abs(goal[i] - angles_[i]));
    }
    const double most = kFastestRadPerS * dt_s;
    const double part = !is_placed_ || farthest <= most ? 1 : most / farthest;
    for (std::size_t i = 0; i < 3; ++i) angles_[i] += part * (goal[i] - angles_[i]);
    is_placed_ = true;
  }
  [[nodiscard]] const Angles& angles() const noexcept { return angles_; }

 private:
  static constexpr int kSweeps = 8, kFirstSweeps = 200;

  [[nodiscard]] static bool is_in_range(const Angles& gimbal) noexcept {
    for (std::size_t i = 0; i < 3; ++i) {
      if (!(std::abs(gimbal[i]) <= kMostRad[i])) return false;
    }
    return true;
  }

  /// The angle within +-most that makes `along` cos x + `across` sin x largest.
  [[nodiscard]] static double best(double along, double across, double most) noexcept {
    const double angle = std::atan2(across, along);
    return std::abs(angle) <= most ? angle : std::copysign(most, angle);
  }

  /// The angles of an orientation within reach; else of one nearby that is, found from where the
  /// wrist is: each angle in turn makes the trace of wanted^T Ry(a) Rx(b) Rz(c) largest.
  [[nodiscard]] Angles reachable(const Matrix3& m, int sweeps) const noexcept {
    if (const Angles exact = angles_of(m); is_in_range(exact)) return exact;
    double a = angles_[0], b = -angles_[1], c = -angles_[2];
    for (int i = 0; i < sweeps; ++i) {
      double sa = std::sin(a), ca = std::cos(a);
      const double sc = std::sin(c), cc = std::cos(c);
      b = best(m[0][2] * sa + m[1][0] * sc + m[1][1] * cc + m[2][2] * ca,
               (m[0][0] * sc + m[0][1] * cc) * sa - m[1][2] + (m[2][0] * sc + m[2][1] * cc) * ca,
               kMostRad[1]);
      const double sb = std::sin(b), cb = std::cos(b);
      a = best(m[0][0] * cc - m[0][1] * sc + (m[2][0] * sc + m[2][1] * cc) * sb + m[2][2] * cb,
               (m[0][0] * sc + m[0][1] * cc) * sb + m[0][2] * cb - m[2][0] * cc + m[2][1] * sc,
               kMostRad[0]);
      sa = std::sin(a);
      ca = std::cos(a);
      c = best((m[0][1] * sa + m[2][1] * ca) * sb + m[0][0] * ca + m[1][1] * cb - m[2][0] * sa,
               (m[0][0] * sa + m[2][0] * ca) * sb - m[0][1] * ca + m[1][0] * cb + m[2][1] * sa,
               kMostRad[2]);
    }
    return {a, -b, -c};
  }

  Angles angles_{};
  bool is_placed_ = false;
};

}  // namespace kerf::hd
