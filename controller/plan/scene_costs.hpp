// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "controller/plan/method/methods.hpp"
#include "controller/plan/tables/tick_memory.hpp"

namespace kerf {

/// What a tick of one tool costs in one volume, and why.
struct TickCost {
  std::size_t tool = 0, volume = 0;  ///< by index of the scene
  MethodChoice choice;
  TickShape shape;
  std::vector<StageCost> stages;  ///< at most: whatever the pose, the speed and the content

  /// Method and what runs it: "aligned/avx512", "gather/double".
  [[nodiscard]] std::string variant() const {
    return choice.method->name + ("/" + std::string(shape.runs_it));
  }
};

/// A tick as it was timed.
struct TickTime {
  double median_us = 0, p99_us = 0;
  std::vector<StageCost> stages;  ///< what it did, of the same stages
};

/// What a scene costs: known before its memory is taken.
struct SceneCosts {
  std::vector<TickCost> ticks;  ///< by tool, then by solid volume
  std::vector<ArrayBytes> arrays;
  /// By tool: speed of the hand up to which it is free of drag in air (air_speed.hpp). Empty where
  /// the force is the paper's.
  std::vector<double> air_speeds_mm_per_s;
};

}  // namespace kerf
