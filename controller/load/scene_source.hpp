// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "controller/load/load_scene.hpp"

namespace kerf {

/// What a scene was loaded from: loaded again, and its volumes and meshes being the same, it is the
/// same to the bit. A run carries it in the JSON of its scene, as `source`, so a recording has it.
struct SceneSource {
  std::filesystem::path path;  ///< absolute; files that the text names lie beside it
  std::string text;            ///< of the scene file
  SceneOverrides overrides;
};

/// Reads the scene file of a command line. Throws LoadError.
[[nodiscard]] SceneSource read_source(const std::filesystem::path& scene,
                                      const SceneOverrides& overrides);

/// As `load_scene` of its path. Throws LoadError.
[[nodiscard]] LoadedScene load_scene(const SceneSource& source);

/// `canonical_json` of the loaded scene, and in it the source as `source`.
[[nodiscard]] std::string json_with_source(const std::string& canonical, const SceneSource& source);

/// The source in such a text. Throws JsonError if it is no JSON, has no source, or one of another
/// form.
[[nodiscard]] SceneSource source_in(std::string_view json);

/// Such a text without its source: what `canonical_json` gave. Throws JsonError.
[[nodiscard]] std::string json_without_source(std::string_view json);

}  // namespace kerf
