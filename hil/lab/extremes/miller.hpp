// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include "controller/scene/compile.hpp"
#include "hil/lab/fake_arm.hpp"

namespace kerf::extremes {

/// A servo that cuts by force, led by a hand that goes where it wants, and the two sides of its
/// balance: what left the volumes, and SUM G F T of what has no label.
class Miller {
 public:
  /// From the inkwell around what there is to be cut and down on `start_mm`; the force is faded in
  /// and the spindle up to speed then. Volumes are low and about the device's origin.
  explicit Miller(Scene scene, const std::array<double, 3>& start_mm = {0, 1.3, 0})
      : tick_s_(1.0 / scene.servo.rate_hz),
        threshold_n_(scene.cut.threshold_n),
        machinability_(scene.cut.machinability_mm3_per_s_n) {
    for (const SceneVolume& volume : scene.volumes) {
      const auto& h = volume.image.spacing_mm;
      mm3_per_step_.push_back(h[0] * h[1] * h[2] / kDensityMax);
    }
    servo_ = compile(scene);
    const int rest = kDockTicks * std::max(1, scene.servo.rate_hz / 1000);
    for (int tick = 0; tick < rest; ++tick) static_cast<void>(servo_->step(arm_.docked()));
    constexpr std::array<double, 3> kAbove{0, 30, -60};
    constexpr int kSteps = 200;
    arm_at(*servo_, arm_, kAbove[0], kAbove[1], kAbove[2]);
    for (int i = 1; i <= kSteps; ++i) {
      const double s = double(i) / kSteps;
      static_cast<void>(
          step({s * start_mm[0], kAbove[1] + s * (start_mm[1] - kAbove[1]), (1 - s) * kAbove[2]}));
    }
    static_cast<void>(hold(start_mm, 0.3));
  }

  ServoOutput step(const std::array<double, 3>& at_mm) {
    const ServoOutput out = servo_->step(arm_.at(at_mm[0], at_mm[1], at_mm[2]));
    for (std::size_t v = 0; v < mm3_per_step_.size(); ++v) {
      removed_mm3_ += mm3_per_step_[v] * static_cast<double>(out.removed_by_volume[v]);
    }
    fed_mm3_ +=
        machinability_ * std::max(0.0, out.press_n - threshold_n_) * out.spindle_ratio * tick_s_;
    return out;
  }
  ServoOutput hold(const std::array<double, 3>& at_mm, double seconds) {
    ServoOutput out;
    const long ticks = std::lround(seconds / tick_s_);
    for (long tick = 0; tick < ticks; ++tick) out = step(at_mm);
    return out;
  }

  [[nodiscard]] double removed_mm3() const { return removed_mm3_; }
  [[nodiscard]] double fed_mm3() const { return fed_mm3_; }

 private:
  double tick_s_, threshold_n_, machinability_;
  std::vector<double> mm3_per_step_;
  std::unique_ptr<Servo> servo_;
  FakeArm arm_;
  double removed_mm3_ = 0, fed_mm3_ = 0;
};

}  // namespace kerf::extremes
