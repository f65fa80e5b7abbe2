// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "controller/servo/servo.hpp"
#include "hil/device/omni.hpp"
#include "shared/wire/omni.hpp"

/// Reports of an Omni without mechanics: the joint counts of a given tip position, by the
/// emulator's own inverse kinematics.
namespace kerf {

/// An Omni at any position, with the counts that it has after power-up.
class KinematicOmni {
 public:
  /// The stylus in the inkwell, buttons up, gimbal centred.
  [[nodiscard]] DeviceReport docked() {
    const auto& dock = omni::kDockRad;
    return report_of({dock[0], dock[1], dock[2]}, true);
  }
  /// The tip at a position of the device's workspace, to the nearest count.
  [[nodiscard]] DeviceReport at(double x_mm, double y_mm, double z_mm) {
    return report_of(arm_.joints_rad({x_mm, y_mm, z_mm}), false);
  }
  /// Turns the wrist for all reports from now on: yaw, pitch and roll, to the nearest count.
  void turn_wrist(const std::array<double, 3>& rad) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double share = (rad[i] - omni::kGimbalOffsetRad[i]) / omni::kGimbalSlopeRad[i];
      wiper_[i] = static_cast<std::uint16_t>(std::lround(std::clamp(share, 0.0, 1.0) * kWipers));
    }
  }

 private:
  DeviceReport report_of(JointVec<double> q, bool docked) {
    const std::array<double, 3> joints{q.x, q.y, q.z};
    DeviceReport report;
    report.fresh = true;
    report.parked = docked;
    report.counter = ++counter_;
    for (std::size_t i = 0; i < 3; ++i) {
      report.wiper_a[i] = wiper_[i];
      report.wiper_b[i] = static_cast<std::uint16_t>(kWipers - wiper_[i]);
      const double turned = (joints[i] - omni::kDockRad[i]) / omni::kRadPerCount;
      const auto counts = kPowerUp[i] + omni::kEncoderSign[i] * std::lround(turned);
      report.counts[i] = static_cast<std::int16_t>(counts);  // wraps as the device does
    }
    return report;
  }

  static constexpr std::array<long, 3> kPowerUp{32760, -32700, 32700};
  static constexpr std::uint16_t kWipers = 0xfffe;  ///< both of a pot; the middle is a whole count
  OmniArm arm_;
  std::array<std::uint16_t, 3> wiper_{kWipers / 2, kWipers / 2, kWipers / 2};
  std::uint32_t counter_ = 0;
};

inline constexpr int kDockTicks = 60;  ///< enough rest in the inkwell to be calibrated at 1 kHz

/// Docks, leaves the inkwell, waits there until the force is faded in.
inline void arm_at(AnyServo& servo, KinematicOmni& arm, double x_mm, double y_mm, double z_mm,
                   int ticks = 1) {
  for (int tick = 0; tick < kDockTicks * ticks; ++tick) static_cast<void>(servo.step(arm.docked()));
  // The move from the inkwell is slow enough for the speed limit: held far away, then close.
  const int steps = 200 * ticks;
  const OmniArm geometry;
  const auto& d = omni::kDockRad;
  const auto start = geometry.tip_mm({d[0], d[1], d[2]});
  for (int i = 1; i <= steps; ++i) {
    const double s = double(i) / steps;
    static_cast<void>(
        servo.step(arm.at(start.x + s * (x_mm - start.x), start.y + s * (y_mm - start.y),
                          start.z + s * (z_mm - start.z))));
  }
}

}  // namespace kerf
