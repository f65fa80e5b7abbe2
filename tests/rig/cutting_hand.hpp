// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numbers>
#include <vector>

#include "controller/plan/compile.hpp"
#include "lab/rig/kinematic_arm.hpp"
#include "tests/rig/geometry.hpp"

/// A servo that cuts by force, led by a hand, and figures of such cuts.
namespace kerf::extremes {

/// A servo that cuts by force, led by a hand that ignores it, and the two sides of its balance: the
/// volume removed, and that of material without a label by the law of the bur, SUM G F T of
/// Preston's.
class CuttingHand {
 public:
  /// From the inkwell around the solid and down on `start_mm`; the force is faded in
  /// and the spindle up to speed then. Volumes are low and about the device's origin.
  explicit CuttingHand(LoadedScene scene, const std::array<double, 3>& start_mm = {0, 1.3, 0})
      : tick_s_(1.0 / scene.servo.rate_hz),
        threshold_n_(scene.cut.threshold_n),
        reference_n_(scene.cut.reference_n),
        law_(scene.tools[scene.active_tool].law),
        machinability_(scene.cut.machinability_mm3_per_s_n) {
    for (const SceneVolume& volume : scene.volumes) {
      const auto& h = volume.image.spacing_mm;
      mm3_per_step_.push_back(h[0] * h[1] * h[2] / kDensityMax);
    }
    servo_ = compile(scene);
    const int per_ms = std::max(1, scene.servo.rate_hz / 1000);
    for (int tick = 0; tick < kDockTicks * per_ms; ++tick)
      static_cast<void>(servo_->step(arm_.docked()));
    constexpr std::array<double, 3> kAbove{0, 30, -60};
    const int steps = 200 * per_ms;
    arm_at(*servo_, arm_, kAbove[0], kAbove[1], kAbove[2], per_ms);
    for (int i = 1; i <= steps; ++i) {
      const double s = double(i) / steps;
      static_cast<void>(
          step({s * start_mm[0], kAbove[1] + s * (start_mm[1] - kAbove[1]), (1 - s) * kAbove[2]}));
    }
    static_cast<void>(hold(start_mm, 0.3));
  }

  /// For all steps from now on: yaw, pitch and roll.
  void turn_wrist(const std::array<double, 3>& rad) { arm_.turn_wrist(rad); }
  ServoOutput step(const std::array<double, 3>& at_mm) {
    at_mm_ = at_mm;
    const ServoOutput out = servo_->step(arm_.at(at_mm[0], at_mm[1], at_mm[2]));
    for (std::size_t v = 0; v < mm3_per_step_.size(); ++v) {
      removed_mm3_ += mm3_per_step_[v] * static_cast<double>(out.removed_by_volume[v]);
    }
    const double drive_n = drive_of(out);
    const double sharp = law_.wear_half_n_s > 0 ? 1 / (1 + worn_n_s_ / law_.wear_half_n_s) : 1;
    fed_mm3_ += machinability_ * drive_n * sharp * tick_s_;
    worn_n_s_ += drive_n * tick_s_;
    return out;
  }
  /// Along a line from the hand's position, at 1 m/s.
  void travel(const Point& to_mm) {
    constexpr double kMmPerS = 1000;
    const Point from_mm = at_mm_, way = to_mm - from_mm;
    const int ticks = 1 + static_cast<int>(length(way) / (kMmPerS * tick_s_));
    for (int i = 1; i <= ticks; ++i) {
      static_cast<void>(step(from_mm + static_cast<double>(i) / ticks * way));
    }
  }
  ServoOutput hold(const std::array<double, 3>& at_mm, double seconds) {
    ServoOutput out;
    const long ticks = std::lround(seconds / tick_s_);
    for (long tick = 0; tick < ticks; ++tick) out = step(at_mm);
    return out;
  }

  [[nodiscard]] AnyServo& servo() { return *servo_; }
  [[nodiscard]] double removed_mm3() const { return removed_mm3_; }
  [[nodiscard]] double fed_mm3() const { return fed_mm3_; }

 private:
  /// Of a bur without wear. The spindle is up to speed.
  [[nodiscard]] double drive_of(const ServoOutput& out) const {
    const double most_n = law_.saturation_n > 0 ? law_.saturation_n : out.press_n;
    const double above_n = std::min(out.press_n, most_n) - threshold_n_;
    if (above_n <= 0) return 0;
    return reference_n_ * std::pow(above_n / reference_n_, law_.force_exponent) *
           std::pow(out.spindle_ratio, law_.speed_exponent);
  }

  double tick_s_, threshold_n_, reference_n_, worn_n_s_ = 0;
  BurLaw law_;
  double machinability_;
  std::vector<double> mm3_per_step_;
  std::unique_ptr<AnyServo> servo_;
  KinematicOmni arm_;
  Point at_mm_{};
  double removed_mm3_ = 0, fed_mm3_ = 0;
};

/// The volume that a hand removes from a flat at height 0 in half a second by a given force, up to
/// 1.2 N and back, mm^3.
inline double removed_by_press(const LoadedScene& scene) {
  CuttingHand miller(scene);
  constexpr double kSeconds = 0.5, kMeanN = 0.6;
  const int ticks = static_cast<int>(kSeconds * scene.servo.rate_hz);
  double proxy_mm = 1;
  for (int i = 0; i < ticks; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.5) / ticks;
    const double force_n = kMeanN * (1 - std::cos(angle));
    const ServoOutput out =
        miller.step({0, proxy_mm - force_n / scene.force.stiffness_n_per_mm, 0});
    proxy_mm = out.position_mm[1] + out.proxy_offset_mm[1];
  }
  return miller.removed_mm3();
}

inline constexpr double kSinkFromMm = 1.3;  ///< of the tool's centre: 0.3 mm of air

/// The force on a hand that sinks a ball of radius 1 mm by 2.5 mm in half a second, from 0.3 mm
/// above a crown at height 0, and stays there for two.
struct SunkForce {
  double step_ratio = 0;  ///< largest step in a tick over the mean, at 1 kHz
  double mean_n = 0;
};

/// A count of the encoders is a step of the hand and not of the cut: such ticks do not count for
/// the step. The miller is above the position.
inline SunkForce sink(CuttingHand& miller, double x_mm = 0, double z_mm = 0) {
  constexpr int kSinkMs = 500, kMs = 2500, kFeltMs = 200;
  double sum_n = 0, largest_n = 0, last_n = 0;
  std::array<double, 3> last_mm{};
  for (int ms = 0; ms < kMs; ++ms) {
    const ServoOutput out = miller.step({x_mm, kSinkFromMm - 0.005 * std::min(ms, kSinkMs), z_mm});
    const double force_n = length(out.commanded_force_n);
    if (ms >= kFeltMs) {
      sum_n += force_n;
      if (out.position_mm == last_mm) largest_n = std::max(largest_n, std::abs(force_n - last_n));
    }
    last_n = force_n;
    last_mm = out.position_mm;
  }
  const double mean_n = sum_n / (kMs - kFeltMs);
  return {largest_n / mean_n, mean_n};
}

}  // namespace kerf::extremes
