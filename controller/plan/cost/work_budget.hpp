// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/scene_costs.hpp"

namespace kerf {

// Which scenes are too dear. Decided from counts of operations and from prices that are constants,
// so that the same scene is taken or refused in every run, however busy the machine is.

/// Half of a tick: a machine half as fast as the reference still ends its ticks in time, and on the
/// reference the other half is there for the device, the eyes and what else runs on the core.
inline constexpr double kBudgetShare = 0.5;

/// Work of one tick of a tool in all volumes: us on the reference machine.
[[nodiscard]] double work_us(const SceneCosts& costs, std::size_t tool);

/// The budget of a tick in the same unit.
[[nodiscard]] double work_budget_us(const LoadedScene& scene);

/// The highest rate with room for so much work, at most kMaxRateHz; 0 where that is below
/// kMinRateHz.
[[nodiscard]] int highest_rate_hz(double work_us);

/// The tool whose tick costs most over all volumes. It decides for the scene, since a command may
/// take it up at any tick.
[[nodiscard]] std::size_t costliest_tool(const SceneCosts& costs);

/// Why the scene is refused: the costliest tool, its costliest stage and the highest rate that
/// fits, on one line with the way out. Empty where every tool fits.
[[nodiscard]] std::string over_budget(const LoadedScene& scene, const SceneCosts& costs);

}  // namespace kerf
