// SPDX-License-Identifier: Apache-2.0
#include "visualizer/render/dirty_cells.hpp"

#include <algorithm>
#include <cmath>

namespace kerf {

DirtyCells::DirtyCells(std::span<const VoxelBox> voxels, const RayFootprint& footprint)
    : reach_(std::max(footprint.along, footprint.at_end)) {
  VoxelBox all;
  for (const VoxelBox& box : voxels) all = all.united(box);
  first_ = all.lo;
  low_ = glm::dvec3(first_.x, first_.y, first_.z) - 0.5 * reach_;
  const VoxelIndex extent = all.extent();
  const int more = reach_ - 1;  // voxel centres at both ends
  grid_ = {extent.x + more, extent.y + more, extent.z + more};
  marks_.resize(grid_.voxel_count() + sizeof(std::uint32_t));
  // The nearer ones last: they lie within the others.
  for (const VoxelBox& box : voxels) mark(box, footprint.at_end, kDirtyAtEnd);
  for (const VoxelBox& box : voxels) mark(box, footprint.along, kDirtyAlong | kDirtyAtEnd);
}

glm::dvec3 DirtyCells::high() const noexcept {
  return low_ + glm::dvec3(grid_.nx, grid_.ny, grid_.nz);
}

void DirtyCells::mark(const VoxelBox& voxels, int reach, std::uint8_t marks) {
  if (reach == 0) return;
  const int inset = (reach_ - reach) / 2;
  const VoxelIndex lo{voxels.lo.x - first_.x + inset, voxels.lo.y - first_.y + inset,
                      voxels.lo.z - first_.z + inset};
  const VoxelIndex extent = voxels.extent();
  for (std::int32_t z = lo.z; z < lo.z + extent.z - 1 + reach; ++z) {
    for (std::int32_t y = lo.y; y < lo.y + extent.y - 1 + reach; ++y) {
      std::fill_n(&marks_[grid_.index(lo.x, y, z)], extent.x - 1 + reach, marks);
    }
  }
}

void DirtyCells::put(DirtyJob& job) const {
  job.cells = marks_.data();
  job.row = grid_.nx;
  job.plane = grid_.nx * grid_.ny;
  const std::int32_t cells[3] = {grid_.nx, grid_.ny, grid_.nz};
  const auto longest = static_cast<float>(std::max({grid_.nx, grid_.ny, grid_.nz}));
  job.most_tests = static_cast<std::int32_t>(longest / job.step_vox) + 3;
  for (int axis = 0; axis < 3; ++axis) {
    job.size[axis] = static_cast<float>(cells[axis]);
    job.last[axis] = std::nextafter(job.size[axis], 0.0F);
  }
}

}  // namespace kerf
