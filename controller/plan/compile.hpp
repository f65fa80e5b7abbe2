// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "controller/kernel/kernel_set.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/scene_costs.hpp"
#include "controller/plan/servo_snapshot.hpp"
#include "controller/servo/servo.hpp"

namespace kerf {

/// A scene turned into plan and memory of the servo step, in the numbers that the scene asks for.
///
/// Each tool has one method in each solid volume (`choose_method`). The costs are known at once;
/// the memory exists after `take`, and nothing is allocated after that.
class CompiledScene : public Servo {
 public:
  [[nodiscard]] virtual const SceneCosts& costs() const noexcept = 0;

  /// Takes the volumes' densities over (they are empty in the scene afterwards) and allocates the
  /// rest. Once, before the first step; `scene` is the one that was compiled.
  virtual void take(LoadedScene& scene) = 0;

  /// Density of volume `scene_index` before the first cut; empty where nothing is cut. After
  /// `take`.
  [[nodiscard]] virtual std::span<const Density> first_density(
      std::size_t scene_index) const noexcept = 0;

  /// `costs().ticks[tick]` as the servo step computes it, at its worst (tick_timing.hpp). Cuts
  /// where the scene cuts: only for a servo that will not be stepped. After `take`; takes 250
  /// ticks.
  [[nodiscard]] virtual TickTime time_tick(std::size_t tick) = 0;

  /// All that the last tick hands to the next, copied. After `take`, between two ticks.
  [[nodiscard]] virtual std::unique_ptr<ServoSnapshot> keep() const = 0;
  /// Goes on where that was kept, by this servo or another of the same scene. Throws
  /// std::invalid_argument where it is of another scene.
  virtual void restore(const ServoSnapshot& kept) = 0;
};

/// Plans, tables and costs of a checked scene; no array of the size of a volume is made. Throws
/// SceneError for a scene that the loop cannot hold: no solid volume, a voxel or a step outside the
/// number formats.
///
/// `kernels` run the loop: the fastest of this machine unless a test asks for others.
[[nodiscard]] std::unique_ptr<CompiledScene> plan_scene(const LoadedScene& scene,
                                                        const KernelSet& kernels = **kernel_sets());

/// `plan_scene` and `take` in one.
[[nodiscard]] std::unique_ptr<CompiledScene> compile(LoadedScene& scene,
                                                     const KernelSet& kernels = **kernel_sets());

}  // namespace kerf
