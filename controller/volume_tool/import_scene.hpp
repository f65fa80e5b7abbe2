// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <limits>
#include <string>

#include "controller/volume/volume_proposal.hpp"

namespace kerf {

/// What the scene of an imported volume says beside its file.
struct ImportedScene {
  std::string source;                        ///< what was imported, for a comment
  std::filesystem::path volume;              ///< beside the scene
  const VolumeProposal* proposal = nullptr;  ///< none: a volume with labels
  Label last_label = 0;                      ///< the highest that a voxel has
  double iso_density = 0;
  int passes = 0;                                     ///< against noise, that the import made
  int longest_vox = std::numeric_limits<int>::max();  ///< no tool is larger
};

/// The text of a scene (TOML) with this volume alone, fitted to any device as --volume fits it.
[[nodiscard]] std::string imported_scene_text(const ImportedScene& scene);

/// Reads that text as the controller will, as `scene`, and throws SceneError where it is no scene
/// of `volume`.
void check_imported_scene(const std::string& text, const std::filesystem::path& scene,
                          const std::filesystem::path& volume);

}  // namespace kerf
