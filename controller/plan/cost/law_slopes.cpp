// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/cost/law_slopes.hpp"

#include <cmath>
#include <memory>

#include "controller/law/registry/law_registry.hpp"
#include "controller/plan/plan_device.hpp"
#include "controller/stability/device_figures.hpp"
#include "shared/numeric/numbers.hpp"

namespace kerf {

std::vector<LawSlope> law_slopes(const LoadedScene& scene) {
  constexpr double kLongestMm = 10, kSpeedMmPerS = 10;
  const auto law = plan_law<ForceInput, DoubleNumbers>(
      scene.force.law, {.rate_hz = double(scene.servo.rate_hz),
                        .tip_noise_mm = device_parts::tip_noise_mm(scene.device.personality)});
  const auto memory = std::make_unique<LawMemory>();
  const auto force_n = [&](double spring_mm, double outward_mm_per_s) {
    ForceInput<DoubleNumbers> in;
    in.spring_mm.y = spring_mm;
    in.velocity_mm_per_s.y = outward_mm_per_s;
    if (spring_mm > 0) in.normal.y = 1;
    memory->begin_anew();
    return law(*memory, in).y;
  };
  const double step_mm = device_figures(scene.device.personality).quantum_mm;
  std::vector<LawSlope> slopes;
  for (double at_mm = step_mm; at_mm <= kLongestMm; at_mm += step_mm) {
    const double before_n = force_n(at_mm - step_mm / 2, 0);
    const LawSlope slope{
        at_mm, (force_n(at_mm + step_mm / 2, 0) - before_n) / step_mm,
        (force_n(at_mm, -kSpeedMmPerS) - force_n(at_mm, kSpeedMmPerS)) / (2 * kSpeedMmPerS)};
    if (before_n >= scene.limits.force_n) break;
    if (std::isfinite(slope.stiffness_n_per_mm) && std::isfinite(slope.damping_ns_per_mm)) {
      slopes.push_back(slope);
    }
  }
  return slopes;
}

}  // namespace kerf
