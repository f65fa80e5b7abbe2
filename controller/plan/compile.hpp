// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "controller/kernel/kernel_set.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/method/tool_method.hpp"
#include "controller/plan/tables/sample_tables.hpp"
#include "controller/servo/servo.hpp"

// A loaded scene to a servo: plan, memory, costs and snapshot.

namespace kerf {

/// Cost of a tick of one tool in one volume, and why.
struct TickCost {
  std::size_t tool = 0, volume = 0;  ///< by index of the scene
  MethodChoice choice;
  TickShape shape;
  std::vector<StageCost> stages;  ///< upper bounds for any pose, speed and content

  /// Method and kernels or numbers: "aligned/avx512", "gather/double".
  [[nodiscard]] std::string variant() const {
    return choice.method->name + ("/" + std::string(shape.runs_it));
  }
};

/// A tick as it was timed.
struct TickTime {
  double median_us = 0, p99_us = 0;
  std::vector<StageCost> stages;  ///< its operations, of the same stages
};

/// Cost of a scene, known before its memory is allocated.
struct SceneCosts {
  std::vector<TickCost> ticks;  ///< by tool, then by solid volume
  std::vector<ArrayBytes> arrays;
  /// By tool: speed of the hand up to which it has no drag in air (air_speed.hpp). Empty for the
  /// paper's force.
  std::vector<double> air_speeds_mm_per_s;
};

/// A servo between two ticks: all that the last tick hands to the next, as values and copies of its
/// arrays. Left out are constants (the plan, the maps of free space, which stay true after a cut)
/// and the scratch of one tick. Any thread; not for the loop.
class ServoSnapshot {
 public:
  virtual ~ServoSnapshot() = default;

  /// The largest fraction that cutting still owes, in full voxels: of a density step by overlap, of
  /// a voxel by force (docs/cutting.md).
  [[nodiscard]] virtual double largest_carry() const = 0;
};

/// A scene turned into plan and memory of the servo step, in the number type of the scene.
///
/// Each tool has one method in each solid volume (`choose_method`). The costs are known at once;
/// the memory exists after `take`, and nothing is allocated after that.
class CompiledScene : public Servo {
 public:
  [[nodiscard]] virtual const SceneCosts& costs() const noexcept = 0;

  /// Takes the volumes' densities over (they are empty in the scene afterwards) and allocates the
  /// rest. Once, before the first step; `scene` is the one that was compiled.
  virtual void take(LoadedScene& scene) = 0;

  /// Density of volume `scene_index` before the first cut; empty if the scene does not cut. After
  /// `take`.
  [[nodiscard]] virtual std::span<const Density> first_density(
      std::size_t scene_index) const noexcept = 0;

  /// `costs().ticks[tick]` as the servo step computes it, at its worst (worst_tick.hpp). Cuts
  /// if the scene does: only for a servo that will not be stepped. After `take`; takes 250
  /// ticks.
  [[nodiscard]] virtual TickTime time_tick(std::size_t tick) = 0;

  /// All that the last tick hands to the next, copied. After `take`, between two ticks.
  [[nodiscard]] virtual std::unique_ptr<ServoSnapshot> keep() const = 0;
  /// Continues from a snapshot that this servo, or another one of the same scene, made. Throws
  /// std::invalid_argument if the scene differs.
  virtual void restore(const ServoSnapshot& kept) = 0;
};

/// Plans, tables and costs of a checked scene; no array of the size of a volume is made. Throws
/// LoadError for a scene that the loop cannot hold: no solid volume, a voxel or a step outside the
/// number formats.
///
/// `kernels` run the loop: the fastest of this machine unless a test gives others.
[[nodiscard]] std::unique_ptr<CompiledScene> plan_scene(const LoadedScene& scene,
                                                        const KernelSet& kernels = **kernel_sets());

/// `plan_scene` and `take` in one.
[[nodiscard]] std::unique_ptr<CompiledScene> compile(LoadedScene& scene,
                                                     const KernelSet& kernels = **kernel_sets());

}  // namespace kerf
