// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "controller/scene/scene.hpp"
#include "controller/servo/device_report.hpp"
#include "hil/devmodel/falcon_arm.hpp"
#include "hil/devmodel/omni_arm.hpp"
#include "hil/devmodel/wooden_arm.hpp"
#include "shared/wire/falcon_constants.hpp"
#include "shared/wire/omni_constants.hpp"
#include "shared/wire/wooden_constants.hpp"

namespace kerf::ranges {

/// A hand without mechanics on any device: reports of the joint counts that put the tip at a place,
/// by the emulator's own inverse kinematics, to the nearest count. A place out of reach gives the
/// nearest angles.
class CountHand {
 public:
  using Counts = std::array<double, 3>;

  explicit CountHand(const DeviceSettings& device) : device_(device) {}

  [[nodiscard]] Counts counts_at(DeviceVec<double> tip_mm) const {
    Counts counts{};
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
      case Personality::woodenhaptics:
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
      report.wiper_a[i] = wiper_[i];
      report.wiper_b[i] = static_cast<std::uint16_t>(kWipers - wiper_[i]);
      report.encoder[i] =
          static_cast<std::int16_t>(std::llround(counts[i]));  // wraps as encoders do
    }
    return report;
  }
  /// The wrist for all reports from now on: 0..1 of each pot.
  void turn_wrist(double share) { wiper_.fill(static_cast<std::uint16_t>(share * kWipers)); }

 private:
  static constexpr std::uint16_t kWipers = 0xfffe;
  DeviceSettings device_;
  std::array<std::uint16_t, 3> wiper_{kWipers / 2, kWipers / 2, kWipers / 2};
  std::uint32_t counter_ = 0;
};

}  // namespace kerf::ranges
