// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>

#include "visualizer/view/scene_view.hpp"

namespace kerf {

/// Writes the iso-surfaces of the solid volumes (of the first volume where none is solid), in mm in
/// the world, as STL or PLY by the name's ending. Each is closed; where volumes overlap so do they.
/// Whole or not at all; with nothing left to show, a valid file without triangles. Needs no GL.
/// Throws VisualizerError or FileError.
void export_surface(const std::filesystem::path& file, const SceneView& scene,
                    std::span<const VolumeContent> contents);

/// Throws now what `export_surface` would throw later: for another ending, or a place that cannot
/// be written.
void check_export(const std::filesystem::path& file);

}  // namespace kerf
