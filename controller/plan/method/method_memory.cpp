// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/method/method_memory.hpp"

namespace kerf {

const AlignedTable& MethodMemory::hold_table(const SceneTool& tool, const LatticeTurn& turn,
                                             const KernelSet& kernels) {
  if (tables_.empty() || tables_.back().tool != &tool || turn_ != turn) {
    turn_ = turn;
    tables_.push_back(
        {&tool, tool.name,
         std::make_unique<AlignedTool>(turned(tool.offsets, turn), exact_taps(kernel_), kernels)});
  }
  return tables_.back().table->table();
}

void MethodMemory::hold_samples(const SceneTool& tool, SampleOrder order) {
  if (!samples_.empty() && samples_.back().tool == &tool) return;
  samples_.push_back({&tool, tool.name, SampleTool(tool.offsets, order)});
}

SampleTable MethodMemory::samples_of(const SceneTool& tool) const noexcept {
  if (samples_.empty() || samples_.back().tool != &tool) return {};
  return samples_.back().table.table();
}

std::vector<ArrayBytes> MethodMemory::arrays() const {
  std::vector<ArrayBytes> list;
  for (const auto& of : tables_) list.push_back({"table of " + of.name, of.table->bytes(), true});
  for (const auto& of : samples_) {
    list.push_back({"ordered samples of " + of.name, of.table.bytes(), true});
  }
  for (const ArrayBytes& array : scratch.arrays()) list.push_back(array);
  return list;
}

}  // namespace kerf
