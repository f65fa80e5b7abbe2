// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "shared/volume/changed_bricks.hpp"
#include "visualizer/scene/scene_view.hpp"
#include "visualizer/surface/block_mesh.hpp"

namespace kerf {

/// The iso-surface of one volume as a mesh for each block of 8^3 cells; after a cut only the blocks
/// around the changed bricks are made again, and the result is that of a full extraction. Closed,
/// each side of a triangle belonging to exactly two, over all blocks together.
///
/// No GL. One thread calls; the first extraction uses the cores that the process may use.
class VolumeSurface {
 public:
  /// `density` and `labels` (empty, or one per voxel) cover the volume. The labels are copied.
  VolumeSurface(const VolumeView& volume, const std::vector<MaterialView>& materials,
                std::span<const Density> density, std::span<const Label> labels,
                GradientFilter gradient = kDefaultGradient);

  /// Follows a change; `density` is all of the volume as it is now. `changed` must hold every voxel
  /// that changed since the last call. Returns the blocks whose mesh changed, ascending.
  std::span<const std::uint32_t> update(std::span<const Density> density,
                                        const ChangedBricks& changed);

  /// Triangles that the last `update` removed, added or coloured anew: all of the cells that have
  /// at least one of these, as they were and as they are.
  [[nodiscard]] std::span<const FineTriangle> changed_triangles() const noexcept {
    return changed_triangles_;
  }

  [[nodiscard]] const VoxelGrid& blocks() const noexcept { return blocks_; }
  [[nodiscard]] VoxelIndex block(std::uint32_t id) const noexcept;
  /// By block id, x fastest as in `blocks()`.
  [[nodiscard]] const std::vector<BlockMesh>& meshes() const noexcept { return meshes_; }

 private:
  enum class Work : std::uint8_t { none, shading, mesh };

  [[nodiscard]] SurfaceSource source(std::span<const Density> density) const;
  void mark(const VoxelBox& blocks, Work work);

  BrickGrid bricks_;
  VoxelGrid blocks_;
  Density iso_;
  glm::vec3 inverse_square_spacing_;
  VertexShading shading_;
  GradientRows gradient_;
  std::vector<Label> labels_;
  std::vector<BlockMesh> meshes_;
  std::vector<Work> work_;                ///< by block; all none between calls
  std::vector<std::uint32_t> marked_;     ///< blocks with work
  std::vector<std::uint32_t> different_;  ///< the result of the last update
  std::vector<FineTriangle> changed_triangles_;
};

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
