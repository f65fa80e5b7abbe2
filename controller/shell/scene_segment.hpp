// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/scene_costs.hpp"
#include "shared/segment/segment_plan.hpp"

namespace kerf {

/// The segment that readers of this scene need. Points into the scene: before `take`.
[[nodiscard]] SegmentSpec segment_spec(const LoadedScene& scene, const std::string& json,
                                       std::uint64_t hash);

/// What a run takes beyond the loaded scene must be there: locked memory that is not would end the
/// program without a word. Throws std::runtime_error with one line.
void check_memory(const LoadedScene& scene, const SceneCosts& costs, std::uint64_t segment_bytes);

}  // namespace kerf
