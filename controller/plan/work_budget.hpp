// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/compile.hpp"

// Which scenes cost too much. Decided from counts of operations and constant prices, so that a
// scene is accepted or refused alike in every run, on a busy machine too.

namespace kerf {

/// Half of a tick: a machine half as fast as the reference still ends its ticks in time, and on the
/// reference the other half is left for the device, the publication and other work of the core.
inline constexpr double kBudgetRatio = 0.5;

/// Work of one tick of a tool in all volumes: us on the reference machine.
[[nodiscard]] double work_us(const SceneCosts& costs, std::size_t tool);

/// The budget of a tick in the same unit.
[[nodiscard]] double work_budget_us(const LoadedScene& scene);

/// The highest rate with room for so much work, at most kMaxRateHz; 0 if that is below kMinRateHz.
[[nodiscard]] int highest_rate_hz(double work_us);

/// The tool whose tick costs most over all volumes. It decides for the scene, since a command may
/// select it at any tick.
[[nodiscard]] std::size_t costliest_tool(const SceneCosts& costs);

/// Why the scene is refused: the costliest tool, its costliest stage and the highest rate that
/// fits, on one line with the remedy. Empty if every tool fits.
[[nodiscard]] std::string budget_error(const LoadedScene& scene, const SceneCosts& costs);

}  // namespace kerf
