// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "controller/kernel/aligned_table.hpp"
#include "controller/kernel/exact_taps.hpp"
#include "controller/kernel/gradient.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/method/method_memory.hpp"
#include "controller/plan/method/stage_cost.hpp"
#include "controller/servo/servo_plan.hpp"

namespace kerf {

/// What an exact integer sum holds.
struct SumUnit {
  double steps;    ///< density steps per voxel edge in one unit
  double largest;  ///< bound of the sum, in units
};

/// The two sums of a method.
struct SumUnits {
  SumUnit contact, modification;
};

/// Sums of stored gradients times weights of 2^15; `terms` bounds the number of full weights.
[[nodiscard]] inline SumUnit gathered_sum(double terms) {
  return {std::ldexp(1.0, -15), std::ldexp(std::max(terms, 1.0), 30)};
}

/// Sums of exact gradients times weights of 2^15, as far as `sum_shift` keeps them.
[[nodiscard]] inline SumUnit exact_sum(const ExactTaps& taps, std::size_t samples) {
  const int bits = 15 - sum_shift(samples);
  return {std::ldexp(taps.factor, -taps.shift - bits),
          std::ldexp(static_cast<double>(samples) * static_cast<double>(kMaxExactGradient), bits)};
}

/// A tool in a solid volume of a scene, and the kernels that run the loop.
struct ToolCase {
  const LoadedScene& scene;
  const SceneTool& tool;
  const SceneVolume& volume;
  const KernelSet& kernels;
};

/// What the operations of a tick depend on, besides the box that the tool fills.
struct TickShape {
  std::size_t samples = 0;
  VoxelGrid grid{};
  CutModel cut = CutModel::none;
  bool swept = false;                   ///< the proxy is felt, so a method has no `contact`
  std::string_view runs_it;             ///< name of the kernels, or "float" or "double"
  const AlignedTable* table = nullptr;  ///< of the method `aligned`
};

/// One way to compute contact and cut of a tool in a volume, as load time knows it: when it serves,
/// what memory it takes and what it costs.
///
/// A new method needs its line in controller/servo/method_list.hpp, a step like
/// controller/servo/splat_step.cpp, and a file like splat_method.cpp: a class derived from this one
/// and the function that returns it. What the class does not say is that of a method that does
/// nothing in a tick. Every stage has a price for each kernel set that runs it (stage_cost.hpp). A
/// table or scratch of its own is held by MethodMemory, and `plan_tool` (plan_tools.hpp) hands it
/// to its ToolInVolume.
class ToolMethod {
 public:
  Method step;
  const char* name;
  /// What would let a cheaper method serve, for a person; empty where there is none.
  const char* advice;

  /// Why it serves; nothing where it does not. The scene alone decides, never the machine. Throws
  /// SceneError for a tool that its integers cannot hold.
  [[nodiscard]] virtual std::optional<std::string> serves(const ToolCase& in) const = 0;

  /// Tells `memory` what its step needs in volume `v` of the plan; returns the table of the method
  /// `aligned`, for others none.
  virtual const AlignedTable* hold(const ToolCase& /*in*/, std::size_t /*v*/,
                                   MethodMemory& /*memory*/) const {
    return nullptr;
  }

  /// What its step's sums count.
  [[nodiscard]] virtual SumUnits sums(const LoadedScene& /*scene*/, std::size_t /*samples*/) const {
    return {gathered_sum(1), gathered_sum(1)};
  }

  /// Its own stages in a tick in which the cells of all samples lie in a box of this size, in low
  /// corners as TickBox::size, whatever the speed and the content. The box may be larger than the
  /// volume.
  [[nodiscard]] virtual std::vector<StageCost> stages(const TickShape& /*shape*/,
                                                      VoxelIndex /*box*/) const {
    return {};
  }

 protected:
  constexpr ToolMethod(Method step, const char* name, const char* advice) noexcept
      : step(step), name(name), advice(advice) {}
  ~ToolMethod() = default;
};

}  // namespace kerf
