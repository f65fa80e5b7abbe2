// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "shared/wire/personality.hpp"
#include "standin/hd/touch_kinematics.hpp"
#include "standin/settings.hpp"

/// How warm the motors of the stand-in's Touch are by what they did.
namespace kerf::hd {

/// One winding per joint, of first order in its torque: dQ/dt = (torque^2 - Q) / kWindingS, the
/// model of the controller's budget (docs/forces.md 5.4). The temperature is Q over that of a
/// torque that the motor may give for ever, 0 to 1. The vendor's prediction is not published.
class MotorHeat {
 public:
  /// Maxon RE25, of a PHANTOM Premium: the only one of these arms whose motors are published.
  static constexpr double kWindingS = 12;
  /// The continuous force of the data sheet with the links at right angles: a lever of one link.
  static constexpr double kContinuousNmm =
      force_figures(standin::kHd.personality).continuous_n * kLinkMm;

  /// The motors gave this force at the tip for `dt_s`.
  void heat_up(const Angles& joints, DeviceVec<double> force_n, double dt_s) noexcept {
    const Angles torque_nmm = torques_of_force(joints, force_n);
    const double part = -std::expm1(-dt_s / kWindingS);
    for (std::size_t i = 0; i < 3; ++i) {
      const double load = torque_nmm[i] / kContinuousNmm;
      heat_[i] += part * (load * load - heat_[i]);
    }
  }
  /// Of turret, thigh and shin.
  [[nodiscard]] Angles temperatures() const noexcept {
    return {std::min(heat_[0], 1.0), std::min(heat_[1], 1.0), std::min(heat_[2], 1.0)};
  }
  [[nodiscard]] double hottest() const noexcept { return std::max({heat_[0], heat_[1], heat_[2]}); }

 private:
  Angles heat_{};  ///< 1: of the continuous torque
};

}  // namespace kerf::hd
