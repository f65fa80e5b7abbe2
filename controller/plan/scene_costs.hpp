// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "controller/plan/plan_choice.hpp"

namespace kerf {

/// A part of a tick and how often its innermost work is done, at most: whatever the pose, the speed
/// and the content. What counts as one operation is told where the plan's cost is made.
struct StageCost {
  const char* stage;
  std::uint64_t operations;
};

/// A stage as it was timed: its median, and the operations that it did there.
struct StageTime {
  double us = 0;
  std::uint64_t operations = 0;
};

/// The ticks of one tool in one volume.
struct PlanCost {
  std::string variant;  ///< plan and what runs it: "aligned/avx512", "gather/double"
  std::vector<StageCost> stages;
};

struct TickCost {
  std::size_t tool = 0, volume = 0;  ///< by index of the scene
  PlanChoice choice;
  PlanCost cost;
};

/// An array of a compiled scene.
struct ArrayBytes {
  std::string name;
  std::uint64_t bytes = 0;
  bool taken = false;  ///< in memory already when the scene is planned
};

/// What a scene costs: known before its memory is taken.
struct SceneCosts {
  std::vector<TickCost> ticks;  ///< by tool, then by solid volume
  std::vector<ArrayBytes> arrays;
};

}  // namespace kerf
