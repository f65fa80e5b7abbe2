// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "controller/load/loaded_scene.hpp"
#include "controller/scene/scene_keys.hpp"

namespace kerf {

/// The scene as readers of the segment and of recordings get it: JSON text on one line, keys
/// sorted, numbers as a short text that reads back equal. The same scene gives the same text
/// on every machine, so its path is left out and a volume's `file` is the text of the scene. Its
/// fnv1a hash identifies everything that determines a run.
///
///   volumes    [{name, file, iso (u16), solid, spacing_mm, grid, pose {position_mm, orientation},
///              density_hash}]
///   tools      [{name, shape, pitch_mm, radius_mm, length_mm, round, turns, size_vox,
///              offsets_half_pitch [x, y, z, x, y, z..], and what it looks like: profile
///              [[y_mm, radius_mm]..] or mesh {points_mm [[x, y, z]..], triangles [[a, b, c]..]};
///              shaft, if one is felt: the outline of it and the handpiece, as profile}]
///   active_tool
///   materials [..], scene, device, force, cut, spindle, limits, servo  as the rows of the table of
///              keys say (`InJson`), of the models that the scene has
[[nodiscard]] std::string canonical_json(const LoadedScene& scene, SceneKeys keys = scene_keys());

}  // namespace kerf
