// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "visualizer/scene/scene_view.hpp"
#include "visualizer/surface/volume_surface.hpp"

namespace kerf {

/// Surfaces as one mesh in the world: what goes into a file.
struct ClosedMesh {
  struct Vertex {
    glm::vec3 position_mm;
    glm::vec3 normal;  ///< outward, of length 1
    glm::vec3 colour;  ///< linear
  };
  std::vector<Vertex> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise from outside

  /// Adds a volume that stands at `world_from_voxel`, which must not mirror. The vertices that its
  /// blocks share become one, so each side of a triangle belongs to exactly one other triangle.
  void append(const VolumeSurface& surface, const glm::dmat4& world_from_voxel);
};

/// Writes the iso-surfaces of the solid volumes (of the first volume if none is solid), in mm in
/// the world, as STL or PLY by the name's ending. Each is closed; if volumes overlap, so do they.
/// Whole or not at all; with nothing left to show, a valid file without triangles. Needs no GL.
/// Throws VisualizerError or FileError.
void export_surface(const std::filesystem::path& file, const SceneView& scene,
                    std::span<const VolumeContent> contents);

/// Throws now what `export_surface` would throw later: for another ending, or a place that cannot
/// be written.
void check_export(const std::filesystem::path& file);

}  // namespace kerf
