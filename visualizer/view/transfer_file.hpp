// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

#include "visualizer/view/look.hpp"
#include "visualizer/view/scene_view.hpp"

namespace kerf {

/// The transfer function as a user keeps it, in TOML:
///
///     [opacity]      # over one voxel edge, 0..1, by material; those left out keep their own
///     enamel = 0.1
///
/// Every mistake is a VisualizerError of one line: `name`, line, value, way out.
[[nodiscard]] Opacities parse_transfer(std::string_view text, const std::string& name);
[[nodiscard]] Opacities read_transfer(const std::filesystem::path& file);

/// Writes the opacities of all materials, whole or not at all. Throws FileError.
void write_transfer(const std::filesystem::path& file, const Opacities& opacities);

/// Throws VisualizerError for a material that the scene does not have.
void check_materials(const Opacities& opacities, const SceneView& scene, const std::string& name);

}  // namespace kerf
