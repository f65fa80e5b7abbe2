// SPDX-License-Identifier: Apache-2.0
#include "visualizer/surface/volume_surface.hpp"

#include <algorithm>
#include <atomic>
#include <thread>

namespace kerf {

namespace {

// Block i lies on voxels 8i-1 to 8i+7, in bricks i-1 and i. What it looks like depends on more.
constexpr std::int32_t kLookReach = 2;  // bricks, on both sides
static_assert(SurfaceLook::kColourReachVox < SurfaceLook::kOpennessReachVox);
static_assert(SurfaceLook::kOpennessReachVox < kBlockEdge * kLookReach);

glm::vec3 inverse_square_spacing(const glm::dmat4& world_from_voxel) {
  glm::dvec3 inverse;
  for (int axis = 0; axis < 3; ++axis) {
    inverse[axis] = 1.0 / glm::dot(world_from_voxel[axis], world_from_voxel[axis]);
  }
  return inverse / std::max({inverse.x, inverse.y, inverse.z});
}

/// Calls `work` for 0..count-1, each once, in any order, on all cores of this process.
template <typename Work>
void for_each_in_parallel(std::int32_t count, const Work& work) {
  std::atomic<std::int32_t> next = 0;
  const auto take = [&] {
    for (std::int32_t i = next++; i < count; i = next++) work(i);
  };
  std::vector<std::jthread> helpers(std::max(1U, std::thread::hardware_concurrency()) - 1);
  for (std::jthread& helper : helpers) helper = std::jthread(take);
  take();
}

}  // namespace

VolumeSurface::VolumeSurface(const VolumeView& volume, const std::vector<MaterialView>& materials,
                             std::span<const Density> density, std::span<const Label> labels)
    : bricks_(volume.bricks),
      blocks_(block_grid(volume.bricks.grid)),
      iso_(std::max(volume.iso, Density{1})),
      inverse_square_spacing_(inverse_square_spacing(volume.world_from_voxel)),
      look_(materials, iso_),
      labels_(labels.begin(), labels.end()),
      meshes_(blocks_.voxel_count()),
      work_(blocks_.voxel_count(), Work::none) {
  const SurfaceSource from = source(density);
  for_each_in_parallel(blocks_.nz, [&](std::int32_t z) {
    for (std::int32_t y = 0; y < blocks_.ny; ++y) {
      for (std::int32_t x = 0; x < blocks_.nx; ++x) {
        meshes_[blocks_.index(x, y, z)] = extract_block(from, {x, y, z});
      }
    }
  });
}

SurfaceSource VolumeSurface::source(std::span<const Density> density) const {
  return {{bricks_.grid, density, labels_}, iso_, inverse_square_spacing_, &look_};
}

VoxelIndex VolumeSurface::block(std::uint32_t id) const noexcept {
  const auto i = static_cast<std::int32_t>(id);
  return {i % blocks_.nx, i / blocks_.nx % blocks_.ny, i / blocks_.nx / blocks_.ny};
}

void VolumeSurface::mark(const VoxelBox& blocks, Work work) {
  const VoxelBox near = blocks.clipped(blocks_.box());
  for (std::int32_t z = near.lo.z; z < near.hi.z; ++z) {
    for (std::int32_t y = near.lo.y; y < near.hi.y; ++y) {
      for (std::int32_t x = near.lo.x; x < near.hi.x; ++x) {
        const std::size_t id = blocks_.index(x, y, z);
        if (work_[id] == Work::none) marked_.push_back(static_cast<std::uint32_t>(id));
        work_[id] = std::max(work_[id], work);
      }
    }
  }
}

std::span<const std::uint32_t> VolumeSurface::update(std::span<const Density> density,
                                                     std::span<const std::uint32_t> changed) {
  VoxelBox box;
  for (const std::uint32_t id : changed) {
    box = box.united(bricks_.voxels(id));
    const VoxelIndex b = bricks_.brick(id);
    mark({b, {b.x + 2, b.y + 2, b.z + 2}}, Work::mesh);
    mark(VoxelBox{b, {b.x + 1, b.y + 1, b.z + 1}}.grown(kLookReach), Work::look);
  }
  std::sort(marked_.begin(), marked_.end());
  different_.clear();
  const SurfaceSource from = source(density);
  for (const std::uint32_t id : marked_) {
    BlockMesh& mesh = meshes_[id];
    if (work_[id] == Work::look) {
      if (update_look(from, block(id), box, mesh)) different_.push_back(id);
    } else {
      BlockMesh now = extract_block(from, block(id));
      if (now != mesh) {
        mesh = std::move(now);
        different_.push_back(id);
      }
    }
    work_[id] = Work::none;
  }
  marked_.clear();
  return different_;
}

}  // namespace kerf
