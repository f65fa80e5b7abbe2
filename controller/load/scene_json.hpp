// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "controller/load/load_scene.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/scene/scene_keys.hpp"
#include "shared/text/json.hpp"

namespace kerf {

/// The scene as readers of the segment and of recordings get it; `canonical_json` is its text, on
/// one line, keys sorted, numbers as a short text that reads back equal. The same scene gives the
/// same text on every machine, so its path is left out and a volume's `file` is the text of the
/// scene. Its fnv1a hash identifies everything that determines a run.
///
///   volumes    [{name, file, iso (u16), solid, spacing_mm, grid, pose {position_mm, orientation},
///              density_hash}]
///   tools      [{name, shape, pitch_mm, radius_mm, length_mm, round, turns, size_vox,
///              offsets_half_pitch [x, y, z, x, y, z..], and what it looks like: profile
///              [[y_mm, radius_mm]..] or mesh {points_mm [[x, y, z]..], triangles [[a, b, c]..]};
///              shaft, if one is felt: the outline of it and the handpiece, as profile}]
///   active_tool
///   second_device, second_limits, second_tool  if there are two arms
///   materials [..], scene, device, force, cut, spindle, limits, servo  as the rows of the table of
///              keys say (`InJson`), of the models that the scene has
[[nodiscard]] Json scene_json(const LoadedScene& scene, SceneKeys keys = scene_keys());
[[nodiscard]] std::string canonical_json(const LoadedScene& scene, SceneKeys keys = scene_keys());

/// What a scene was loaded from. If its volumes and meshes have not changed, loading it again gives
/// the same scene, bit by bit. A run has it in the JSON of its scene, as `source`, so a recording
/// has it too.
struct SceneSource {
  std::filesystem::path path;  ///< absolute; files that the text names lie beside it
  std::string text;            ///< of the scene file
  SceneOverrides overrides;
};

/// Reads the scene file of a command line. Throws LoadError.
[[nodiscard]] SceneSource read_source(const std::filesystem::path& scene,
                                      const SceneOverrides& overrides);

/// Loads the scene of a source. Throws LoadError.
[[nodiscard]] LoadedScene load_scene(const SceneSource& source, RecordedInputs recorded = {});

/// The canonical text of `root`, the `scene_json` of a scene, with one more member `source`: what
/// the scene was loaded from, and the materials that were proposed for its first volume.
[[nodiscard]] std::string json_with_source(Json root, const LoadedScene& scene,
                                           const SceneSource& source);

/// The volumes and meshes in such a text. A volume has no density and no labels yet, only their
/// hash.
struct InputsInJson {
  RecordedInputs inputs;
  std::vector<std::string> density_hashes;  ///< by volume
};
/// Throws JsonError if it has none, and LoadError for a volume of impossible size.
[[nodiscard]] InputsInJson inputs_in(std::string_view json);

/// The source in such a text. Throws JsonError if it is no JSON, has no source, or one of another
/// form.
[[nodiscard]] SceneSource source_in(std::string_view json);

/// The text of `json_with_source` without the source: the `canonical_json`. Throws JsonError.
[[nodiscard]] std::string json_without_source(std::string_view json);

}  // namespace kerf
