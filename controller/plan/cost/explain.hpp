// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/compile.hpp"
#include "controller/plan/cost/calibration.hpp"
#include "controller/plan/scene_costs.hpp"
#include "shared/segment/segment_plan.hpp"

namespace kerf {

/// One stage as it is explained. Two systems of prices meet here: `work_us` is what the operations
/// of the worst tick cost on the reference machine, against the budget (work_budget.hpp); the other
/// times are of this machine and of the operations that were timed.
struct ExplainedStage {
  StageCost cost;  ///< at most
  double work_us = 0;
  std::uint64_t timed_operations = 0;
  std::optional<double> predicted_us;  ///< only where the calibration knows the stage
  double measured_us = 0;
};

/// One tool in one volume.
struct ExplainedTick {
  std::string tool, volume, variant, why;
  std::vector<ExplainedStage> stages;
};

/// What `--explain` tells of a scene.
struct Explanation {
  std::string scene, numeric, cut, machine;
  int rate_hz = 1000;
  double budget_us = 0;  ///< of work, for one tool in all volumes
  std::vector<ExplainedTick> ticks;
  std::vector<ArrayBytes> arrays;  ///< of the servo, then of the segment
};

/// The parts of a segment as its layout places them, each up to where the next one begins.
[[nodiscard]] std::vector<ArrayBytes> segment_arrays(const SegmentPlan& plan,
                                                     const LoadedScene& scene);

/// Times every tool in every volume of a scene that `servo` has taken; see `time_stages`.
[[nodiscard]] Explanation explain(const LoadedScene& scene, CompiledScene& servo,
                                  const SegmentPlan& segment, const Calibration& calibration);

/// For a person.
[[nodiscard]] std::string explanation_text(const Explanation& explanation);

/// The same figures as JSON; ends with a newline.
[[nodiscard]] std::string explanation_json(const Explanation& explanation);

}  // namespace kerf
