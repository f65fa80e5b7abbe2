// SPDX-License-Identifier: Apache-2.0
#include "hil/devmodel/reach_curve.hpp"

#include <algorithm>
#include <cmath>

namespace kerf {

DeviceVec<double> ReachCurve::at(double progress) const noexcept {
  const double t = progress, rest = 1 - progress;
  return points_mm[0] * (rest * rest * rest) + points_mm[1] * (3 * rest * rest * t) +
         points_mm[2] * (3 * rest * t * t) + points_mm[3] * (t * t * t);
}

double ReachCurve::least_seconds(double hand_rad_per_s) const noexcept {
  constexpr int kSteps = 512;
  constexpr double kRate = kSteps;
  const auto place = [this](int step) {
    return at(least_jerk(std::clamp(step / kRate, 0.0, 1.0)));
  };
  double speed = 0, acceleration = 0, jerk = 0;
  for (int step = 0; step <= kSteps; ++step) {
    // Central differences over half a step to both sides of a sample, or of a gap between two.
    const auto a = place(step - 1), b = place(step), c = place(step + 1), d = place(step + 2);
    speed = std::max(speed, kRate * norm(c - b));
    acceleration = std::max(acceleration, kRate * kRate * norm(c - b * 2.0 + a));
    jerk = std::max(jerk, kRate * kRate * kRate * norm(d - c * 3.0 + b * 3.0 - a));
  }
  return std::max({speed / kMaxMmPerS, std::sqrt(acceleration / kMaxMmPerS2),
                   std::cbrt(jerk / kSwingMm) / hand_rad_per_s});
}

ReachCurve reach_curve(const HandRoute& route, DeviceVec<double> from_mm,
                       DeviceVec<double> start_mm) noexcept {
  if (!route.detour) {
    const DeviceVec<double> third = (start_mm - from_mm) * (1.0 / 3);
    return {{from_mm, from_mm + third, start_mm - third, start_mm}};
  }
  const DeviceVec<double> above_mm = from_mm + DeviceVec<double>{0, route.detour->lift_mm, 0};
  const DeviceVec<double> beside_mm{start_mm.x, std::max(route.detour->y_mm, start_mm.y),
                                    route.detour->z_mm};
  return {{from_mm, above_mm, beside_mm, start_mm}};
}

}  // namespace kerf
