// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <numeric>

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/scene_costs.hpp"
#include "controller/servo/servo.hpp"
#include "shared/numeric/fnv1a.hpp"

namespace kerf::ranges {

/// Of all densities of the scene.
[[nodiscard]] inline std::uint64_t sum_of(const Servo& servo, std::size_t volumes) {
  std::uint64_t sum = 0;
  for (std::size_t v = 0; v < volumes; ++v) {
    const auto density = servo.density(v);
    sum = std::accumulate(density.begin(), density.end(), sum);
  }
  return sum;
}

/// Of all that the last tick told and left; its output hash is a chain over all ticks.
[[nodiscard]] inline std::uint64_t hash_of(const Servo& servo, std::size_t volumes,
                                           const ServoOutput& last) {
  std::uint64_t hash = fnv1a_step(last.output_hash, std::bit_cast<std::uint64_t>(last.absorbed_mj));
  for (const double mm : last.position_mm)
    hash = fnv1a_step(hash, std::bit_cast<std::uint64_t>(mm));
  for (const double mm : last.proxy_offset_mm) {
    hash = fnv1a_step(hash, std::bit_cast<std::uint64_t>(mm));
  }
  for (std::size_t v = 0; v < volumes; ++v) {
    for (const Density density : servo.density(v)) hash = fnv1a_step(hash, density);
  }
  return hash;
}

/// That contact may read in a tick of the active tool.
[[nodiscard]] inline std::uint64_t most_samples(const SceneCosts& costs, const LoadedScene& scene) {
  std::uint64_t samples = 0;
  for (const TickCost& cost : costs.ticks) {
    const bool counts = cost.tool == scene.active_tool && cost.shape.swept;
    if (counts) samples += cost.stages.front().operations;
  }
  return samples;
}

}  // namespace kerf::ranges
