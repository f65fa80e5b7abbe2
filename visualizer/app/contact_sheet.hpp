// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <span>

#include "visualizer/compose/hand_painter.hpp"
#include "visualizer/view/scene_view.hpp"

namespace kerf {

/// Writes a PNG with one moment of a session, volumes and tool, as every renderer draws it, each
/// with its name. Needs a current GL context. Throws FileError, and VisualizerError where a
/// renderer cannot show the volumes.
void write_contact_sheet(const std::filesystem::path& file, const SceneView& scene,
                         std::span<const VolumeContent> contents, const std::optional<Hand>& hand);

}  // namespace kerf
