// SPDX-License-Identifier: Apache-2.0
#include "visualizer/surface/volume_surface.hpp"

#include <algorithm>
#include <utility>

#include "shared/volume/voxel_grid.hpp"
#include "visualizer/cast/caster.hpp"
#include "visualizer/surface/block_mesh.hpp"

namespace kerf {

namespace {

/// Blocks of which a sample lies in `box`: block i has samples 8i-1 to 8i+7.
VoxelBox blocks_on(const VoxelBox& box) {
  static_assert(kBlockEdge == 8);
  return {{box.lo.x >> 3, box.lo.y >> 3, box.lo.z >> 3},
          {(box.hi.x >> 3) + 1, (box.hi.y >> 3) + 1, (box.hi.z >> 3) + 1}};
}

glm::vec3 inverse_square_spacing(const glm::dmat4& world_from_voxel) {
  glm::dvec3 inverse;
  for (int axis = 0; axis < 3; ++axis) {
    inverse[axis] = 1.0 / glm::dot(world_from_voxel[axis], world_from_voxel[axis]);
  }
  return inverse / std::max({inverse.x, inverse.y, inverse.z});
}

}  // namespace

VolumeSurface::VolumeSurface(const VolumeView& volume, const std::vector<MaterialView>& materials,
                             std::span<const Density> density, std::span<const Label> labels,
                             GradientFilter gradient)
    : bricks_(volume.bricks),
      blocks_(block_grid(volume.bricks.grid)),
      iso_(std::max(volume.iso, Density{1})),
      inverse_square_spacing_(inverse_square_spacing(volume.world_from_voxel)),
      shading_(materials, iso_),
      gradient_(gradient, bricks_.grid, density),
      labels_(labels.begin(), labels.end()),
      meshes_(blocks_.voxel_count()),
      work_(blocks_.voxel_count(), Work::none) {
  const SurfaceSource from = source(density);
  TilePool().run(static_cast<std::uint32_t>(blocks_.nz), [&](std::uint32_t layer) {
    const auto z = static_cast<std::int32_t>(layer);
    for (std::int32_t y = 0; y < blocks_.ny; ++y) {
      for (std::int32_t x = 0; x < blocks_.nx; ++x) {
        meshes_[blocks_.index(x, y, z)] = extract_block(from, {x, y, z});
      }
    }
  });
}

SurfaceSource VolumeSurface::source(std::span<const Density> density) const {
  return {{bricks_.grid, density, labels_}, iso_, inverse_square_spacing_, &shading_, &gradient_};
}

VoxelIndex VolumeSurface::block(std::uint32_t id) const noexcept {
  const auto i = static_cast<std::int32_t>(id);
  return {i % blocks_.nx, i / blocks_.nx % blocks_.ny, i / blocks_.nx / blocks_.ny};
}

void VolumeSurface::mark(const VoxelBox& blocks, Work work) {
  const VoxelBox near = blocks.clipped(blocks_.box());
  for_each_voxel(near, [&](int x, int y, int z) {
    const std::size_t id = blocks_.index(x, y, z);
    if (work_[id] == Work::none) marked_.push_back(static_cast<std::uint32_t>(id));
    work_[id] = std::max(work_[id], work);
  });
}

std::span<const std::uint32_t> VolumeSurface::update(std::span<const Density> density,
                                                     const ChangedBricks& changed) {
  VoxelBox all;
  for (const ChangedBrick& brick : changed) {
    const VoxelBox box = ChangedBricks::bounds(brick, bricks_);
    if (box.empty()) continue;
    all = all.united(box);
    gradient_.update(box, density);
    mark(blocks_on(box), Work::mesh);
    mark(blocks_on(box.grown(VertexShading::kAoReachVox)), Work::shading);
  }
  std::sort(marked_.begin(), marked_.end());
  different_.clear();
  changed_triangles_.clear();
  const SurfaceSource from = source(density);
  for (const std::uint32_t id : marked_) {
    BlockMesh& mesh = meshes_[id];
    const Work work = std::exchange(work_[id], Work::none);
    if (work == Work::shading && mesh.vertices.empty()) continue;
    ChangedMeshCells cells;
    if (work == Work::shading) {
      cells = update_shading(from, block(id), all, mesh);
    } else {
      BlockMesh now = extract_block(from, block(id));
      cells = difference(mesh, now);
      cells.append_triangles(mesh, block(id), changed_triangles_);
      mesh = std::move(now);
    }
    if (!cells.any()) continue;
    cells.append_triangles(mesh, block(id), changed_triangles_);
    different_.push_back(id);
  }
  marked_.clear();
  return different_;
}

}  // namespace kerf
