// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/compile.hpp"
#include "controller/plan/cost/gain_margin.hpp"
#include "controller/plan/scene_costs.hpp"
#include "shared/segment/segment_plan.hpp"

namespace kerf {

/// One tool in one volume: what decides about the scene, and a tick as it was timed.
struct ExplainedTick {
  std::string tool, volume, variant, why;
  std::vector<StageCost> most;  ///< their work counts against the budget (work_budget.hpp)
  TickTime time;
};

/// What `--explain` tells of a scene.
struct Explanation {
  std::string scene, numeric, cut, machine;
  /// Time here over work on the reference machine, of all ticks that were timed. A stage's work
  /// times this predicts what it takes here.
  double machine_factor = 1;
  int rate_hz = 1000;
  double budget_us = 0;  ///< of work, for one tool in all volumes
  std::vector<ExplainedTick> ticks;
  std::vector<ArrayBytes> arrays;  ///< of the servo, then of the segment
  GainMargin gain;
  std::string gain_lines;  ///< the same for a person
};

/// The parts of a segment as its layout places them, each up to where the next one begins.
[[nodiscard]] std::vector<ArrayBytes> segment_arrays(const SegmentPlan& plan,
                                                     const LoadedScene& scene);

/// Times every tool in every volume of a scene that `servo` has taken; see
/// `CompiledScene::time_tick`.
[[nodiscard]] Explanation explain(const LoadedScene& scene, CompiledScene& servo,
                                  const SegmentPlan& segment);

/// For a person.
[[nodiscard]] std::string explanation_text(const Explanation& explanation);

/// The same figures as JSON; ends with a newline.
[[nodiscard]] std::string explanation_json(const Explanation& explanation);

}  // namespace kerf
