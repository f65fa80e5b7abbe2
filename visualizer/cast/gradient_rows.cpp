// SPDX-License-Identifier: Apache-2.0
#include "visualizer/cast/gradient_rows.hpp"

#include <algorithm>
#include <cmath>

#include "visualizer/cast/caster.hpp"

namespace kerf {

namespace {

GradientRows::Entry entry_of(const glm::vec3& gradient) {
  const auto part = [](float g) { return static_cast<std::uint16_t>(g * 32767.0F + 32768.5F); };
  return {part(gradient.x), part(gradient.y), part(gradient.z), 0};
}

/// `box`, and the border beside it where it ends with the volume.
VoxelBox with_border(const VoxelBox& box, const VoxelGrid& grid) {
  const auto low = [](std::int32_t lo) { return lo == 0 ? -1 : lo; };
  const auto high = [](std::int32_t hi, std::int32_t end) { return hi == end ? end + 1 : hi; };
  return {{low(box.lo.x), low(box.lo.y), low(box.lo.z)},
          {high(box.hi.x, grid.nx), high(box.hi.y, grid.ny), high(box.hi.z, grid.nz)}};
}

}  // namespace

std::size_t GradientRows::entry_count(const VoxelGrid& grid) noexcept {
  // A plane more: a cell beyond the last voxels is read and has no weight.
  return static_cast<std::size_t>(grid.nx + 2) * static_cast<std::size_t>(grid.ny + 2) *
         static_cast<std::size_t>(grid.nz + 3);
}

GradientRows::GradientRows(const GradientPlan& plan, const VoxelGrid& grid,
                           std::span<const Density> density)
    : plan_(plan), grid_(grid), entries_(entry_count(grid), kNone) {
  constexpr std::int32_t kThick = 16;  // a layer is worked out by one thread
  const VoxelBox all = grid.box().grown(1);
  const auto layers = static_cast<std::uint32_t>((all.extent().z + kThick - 1) / kThick);
  TilePool().run(layers, [&](std::uint32_t layer) {
    VoxelBox box = all;
    box.lo.z += static_cast<std::int32_t>(layer) * kThick;
    box.hi.z = std::min(box.lo.z + kThick, all.hi.z);
    Work work;
    fill(box, density, work);
  });
}

void GradientRows::fill(const VoxelBox& box, std::span<const Density> density, Work& work) {
  fill_gradients(plan_, grid_, density, box, work.gradients, work.filters);
  const glm::vec3* from = work.gradients.data();
  const std::int32_t wide = box.hi.x - box.lo.x;
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y, from += wide) {
      const auto to = entries_.begin() + static_cast<std::ptrdiff_t>(place({box.lo.x, y, z}));
      std::transform(from, from + wide, to, entry_of);
    }
  }
}

std::vector<VoxelBox> GradientRows::update(const ChangedBricks& changed,
                                           std::span<const Density> density) {
  std::vector<VoxelBox> boxes = plan_.around(changed, BrickGrid::of(grid_));
  for (VoxelBox& box : boxes) {
    box = with_border(box, grid_);
    fill(box, density, work_);
  }
  return boxes;
}

std::size_t GradientRows::place(const VoxelIndex& voxel) const noexcept {
  const auto row = static_cast<std::ptrdiff_t>(grid_.nx) + 2;
  const std::ptrdiff_t plane = row * (grid_.ny + 2);
  return static_cast<std::size_t>((voxel.z + 1) * plane + (voxel.y + 1) * row + voxel.x + 1);
}

glm::vec3 GradientRows::at(const VoxelIndex& voxel) const noexcept {
  const Entry& entry = entries_[place(voxel)];
  return (glm::vec3(entry[0], entry[1], entry[2]) - 32768.0F) * (1.0F / 32767.0F);
}

CastGradient GradientRows::view() const noexcept {
  CastGradient view;
  view.entries = entries_.data()->data();
  view.row = grid_.nx + 2;
  view.plane = view.row * (grid_.ny + 2);
  const std::int32_t extent[3] = {grid_.nx, grid_.ny, grid_.nz};
  for (int axis = 0; axis < 3; ++axis) {
    // The last cell of voxels ends at extent + 1; its far side belongs to no cell.
    view.per_edge[axis] = plan_.per_edge[axis];
    view.last[axis] = std::nextafter(static_cast<float>(extent[axis] + 1), 0.0F);
  }
  return view;
}

}  // namespace kerf
