// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "controller/scene/scene.hpp"
#include "controller/servo/servo.hpp"
#include "hil/device/falcon.hpp"
#include "hil/device/omni.hpp"
#include "hil/device/wooden.hpp"
#include "shared/wire/cartesian.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/omni.hpp"
#include "shared/wire/woodenhaptics.hpp"

namespace kerf::ranges {

/// A hand on any device: reports of joint counts, rounded to whole ones. A position out of reach
/// gives the nearest angles.
class KinematicHand {
 public:
  using Counts = std::array<double, 3>;

  explicit KinematicHand(const DeviceSettings& device) : device_(device) {}

  [[nodiscard]] Counts counts_at(DeviceVec<double> tip_mm) const {
    Counts counts{};
    if (const auto figures = cartesian::figures(device_.personality)) {
      const double per_mm = 1000.0 / figures->step_um;
      return {tip_mm.x * per_mm, tip_mm.y * per_mm, tip_mm.z * per_mm};
    }
    JointVec<double> q;
    switch (device_.personality) {
      case Personality::omni: {
        q = OmniArm().joints_rad(tip_mm);
        const std::array<double, 3> joints{q.x, q.y, q.z};
        for (std::size_t i = 0; i < 3; ++i) {
          counts[i] =
              (joints[i] - device_.dock_rad[i]) / (omni::kEncoderSign[i] * omni::kRadPerCount);
        }
        return counts;
      }
      case Personality::falcon:
        q = FalconArm().joints_rad(tip_mm);
        for (std::size_t i = 0; i < 3; ++i) {
          counts[i] = (std::array{q.x, q.y, q.z}[i] - falcon::kZeroRad) / falcon::kRadPerCount;
        }
        return counts;
      default:
        break;
    }
    q = WoodenArm().joints_rad(tip_mm);
    for (std::size_t i = 0; i < 3; ++i) {
      counts[i] = std::array{q.x, q.y, q.z}[i] / wooden::kRadPerCount[i];
    }
    return counts;
  }

  [[nodiscard]] DeviceReport report(const Counts& counts, bool parked) {
    DeviceReport report;
    report.fresh = true;
    report.parked = parked;
    report.counter = ++counter_;
    for (std::size_t i = 0; i < 3; ++i) {
      report.counts[i] =
          static_cast<std::int16_t>(std::llround(counts[i]));  // wraps as encoders do
    }
    if (is_cartesian(device_.personality)) {
      // The share of a pot as a turn about the shaft, from -90 to 90 degrees.
      const double half = (wiper_[0] / static_cast<double>(kWipers) - 0.5) * std::numbers::pi / 2;
      report.kind = DeviceReport::Kind::pose;
      report.orientation = {0, orientation_part(std::sin(half)), 0,
                            orientation_part(std::cos(half))};
      return report;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      report.wiper_a[i] = wiper_[i];
      report.wiper_b[i] = static_cast<std::uint16_t>(kWipers - wiper_[i]);
    }
    return report;
  }
  /// The wrist for all reports from now on: 0..1 of each pot.
  void turn_wrist(double share) { wiper_.fill(static_cast<std::uint16_t>(share * kWipers)); }

 private:
  [[nodiscard]] static std::int16_t orientation_part(double part) {
    return static_cast<std::int16_t>(std::lround(part * cartesian::kQuaternionOne));
  }

  static constexpr std::uint16_t kWipers = 0xfffe;
  DeviceSettings device_;
  std::array<std::uint16_t, 3> wiper_{kWipers / 2, kWipers / 2, kWipers / 2};
  std::uint32_t counter_ = 0;
};

}  // namespace kerf::ranges
