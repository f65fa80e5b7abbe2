// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "controller/kernel/kernel_set.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/method/tool_method.hpp"
#include "controller/plan/tables/sample_tables.hpp"
#include "controller/servo/servo.hpp"
#include "controller/servo/servo_state.hpp"

// From a loaded scene to a servo: plan, memory, costs, snapshot, and whether a tick has time for
// it.

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
  std::vector<TickCost> ticks;  ///< by tool, then by solid volume; of one arm
  std::size_t arms = 1;
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

  /// Memory that it takes, about.
  [[nodiscard]] virtual std::size_t bytes() const noexcept = 0;
};

/// A scene turned into plan and memory of the servo step, in the number type of the scene.
///
/// Each tool has one method in each solid volume (`choose_method`). The costs are known at once;
/// the memory exists after `take`, and nothing is allocated after that.
class CompiledScene : public AnyServo {
 public:
  [[nodiscard]] virtual const SceneCosts& costs() const noexcept = 0;

  /// Moves the volumes' densities out of `scene`, which is the one that was compiled, and allocates
  /// the rest. Call it once, before the first step.
  virtual void take(LoadedScene& scene) = 0;

  /// Plan and state of each arm as `servo_step` takes them, in the numbers of the scene: for a
  /// program that steps them itself (docs/determinism.md). They point into this servo. After
  /// `take`.
  [[nodiscard]] virtual std::variant<Arms<FixedNumbers>, Arms<DoubleNumbers>> parts()
      const noexcept = 0;

  /// Density of volume `scene_index` before the first cut; empty if the scene does not cut. After
  /// `take`.
  [[nodiscard]] virtual std::span<const Density> first_density(
      std::size_t scene_index) const noexcept = 0;

  /// Times `costs().ticks[tick]` in the worst case of the servo step (worst_tick.hpp), over 250
  /// ticks. If the scene cuts, this does, too: use a servo that will not be stepped. After `take`.
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

// Which scenes cost too much. Decided from counts of operations and constant prices, so that a
// scene is accepted or refused alike in every run, on a busy machine too.

/// Half of a tick: a machine half as fast as the reference still ends its ticks in time, and on the
/// reference the other half is left for the device, the publication and other work of the core.
inline constexpr double kBudgetRatio = 0.5;

/// Work of one tick in all volumes, if every arm has this tool: us on the reference machine.
[[nodiscard]] double work_us(const SceneCosts& costs, std::size_t tool);

/// The budget of a tick in the same unit.
[[nodiscard]] double work_budget_us(const LoadedScene& scene);

/// The highest rate whose budget covers this work, at most kMaxRateHz; 0 if it is below kMinRateHz.
[[nodiscard]] int highest_rate_hz(double work_us);

/// The tool whose tick costs most over all volumes. It decides for the scene, since a command may
/// select it at any tick.
[[nodiscard]] std::size_t costliest_tool(const SceneCosts& costs);

/// Why the scene is refused: the costliest tool, its costliest stage and the highest rate that
/// fits, on one line with the remedy. Empty if every tool fits.
[[nodiscard]] std::string budget_error(const LoadedScene& scene, const SceneCosts& costs);

}  // namespace kerf
