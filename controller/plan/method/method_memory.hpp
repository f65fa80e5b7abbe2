// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "controller/kernel/kernel_set.hpp"
#include "controller/plan/method/lattice.hpp"
#include "controller/plan/tables/aligned_tool.hpp"
#include "controller/plan/tables/sample_tool.hpp"
#include "controller/plan/tables/tick_memory.hpp"
#include "shared/volume/scene_limits.hpp"

namespace kerf {

/// What the methods of a scene's tools need, as they tell it one after the other: tables and
/// scratch at once, of arrays whose type is the loop's their length. Of several wishes the largest
/// counts. Load time.
class MethodMemory {
 public:
  /// Entries, 0 where nobody needs an array.
  struct Lengths {
    std::array<std::size_t, kMaxVolumes> gradients{}, carry{};  ///< by volume of the plan
    std::size_t overlap = 0, refresh = 0;
  };
  Lengths lengths;
  SplatMemory scratch;  ///< of the tick, for all tools

  explicit MethodMemory(GradientKernel kernel) : kernel_(kernel) {}

  /// The tool's table for this turn; it stays where it is, and a tool that is turned alike in its
  /// next volume gets the same.
  const AlignedTable& hold_table(const SceneTool& tool, const LatticeTurn& turn,
                                 const KernelSet& kernels);
  /// The tool's samples for fixed point in any pose, the same for all its volumes.
  void hold_samples(const SceneTool& tool, SampleOrder order);
  /// Those of the tool that was told last, where it has some; they stay where they are.
  [[nodiscard]] SampleTable samples_of(const SceneTool& tool) const noexcept;
  /// What is taken already, by name.
  [[nodiscard]] std::vector<ArrayBytes> arrays() const;

  static void need(std::size_t& length, std::size_t wish) { length = std::max(length, wish); }

 private:
  template <class Table>
  struct OfTool {
    const SceneTool* tool;
    std::string name;
    Table table;
  };

  GradientKernel kernel_;
  LatticeTurn turn_{};  ///< of the last table
  std::vector<OfTool<std::unique_ptr<AlignedTool>>> tables_;
  std::vector<OfTool<SampleTool>> samples_;
};

}  // namespace kerf
