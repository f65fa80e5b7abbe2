// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "shared/volume/brick_grid.hpp"
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
  /// `density` and `labels` (empty, or one per voxel) cover the volume. Both are copied; the
  /// density so that an update knows which voxels of a changed brick are others: far fewer than
  /// all.
  VolumeSurface(const VolumeView& volume, const std::vector<MaterialView>& materials,
                std::span<const Density> density, std::span<const Label> labels,
                GradientFilter gradient = GradientFilter::corners);

  /// Follows a change of bricks `changed` (of the segment's brick grid); `density` is all of the
  /// volume. Returns the blocks whose mesh is another one now, ascending.
  std::span<const std::uint32_t> update(std::span<const Density> density,
                                        std::span<const std::uint32_t> changed);

  /// What the last `update` took away, made, or gave another look: all triangles of the cells in
  /// which there is any, as they were and as they are.
  [[nodiscard]] std::span<const FineTriangle> dirty_triangles() const noexcept {
    return dirty_triangles_;
  }

  [[nodiscard]] const VoxelGrid& blocks() const noexcept { return blocks_; }
  [[nodiscard]] VoxelIndex block(std::uint32_t id) const noexcept;
  /// By block id, x fastest as in `blocks()`.
  [[nodiscard]] const std::vector<BlockMesh>& meshes() const noexcept { return meshes_; }

 private:
  enum class Work : std::uint8_t { none, look, mesh };

  [[nodiscard]] SurfaceSource source() const;
  /// Takes over what differs in `box` and returns the smallest box around it.
  VoxelBox follow(std::span<const Density> density, const VoxelBox& box);
  void mark(const VoxelBox& blocks, Work work);

  BrickGrid bricks_;
  VoxelGrid blocks_;
  Density iso_;
  glm::vec3 inverse_square_spacing_;
  VertexShading look_;
  GradientFilter gradient_;
  std::vector<Density> density_;
  std::vector<Label> labels_;
  std::vector<BlockMesh> meshes_;
  std::vector<Work> work_;                ///< by block; all none between calls
  std::vector<std::uint32_t> marked_;     ///< blocks with work
  std::vector<std::uint32_t> different_;  ///< what the last update returned
  std::vector<FineTriangle> dirty_triangles_;
};

}  // namespace kerf
