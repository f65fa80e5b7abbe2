// SPDX-License-Identifier: Apache-2.0
#include "visualizer/cast/macrocells.hpp"

#include <algorithm>

#include "shared/volume/voxel_loops.hpp"

namespace kerf {

Macrocells::Macrocells(VoxelGrid volume, std::span<const Density> density, Density iso,
                       std::int32_t edge)
    : volume_(volume),
      edge_(edge),
      grid_{volume.nx / edge + 1, volume.ny / edge + 1, volume.nz / edge + 1},
      iso_(iso),
      active_(grid_.voxel_count()) {
  for_each_voxel(grid_.box(), [&](int x, int y, int z) { update_cell({x, y, z}, density); });
}

bool Macrocells::update_cell(VoxelIndex cell, std::span<const Density> density) {
  const VoxelIndex lo{cell.x * edge_ - 1, cell.y * edge_ - 1, cell.z * edge_ - 1};
  const VoxelBox box =
      VoxelBox{lo, {lo.x + edge_ + 1, lo.y + edge_ + 1, lo.z + edge_ + 1}}.clipped(volume_.box());
  Density highest = 0;
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      const auto row = density.subspan(volume_.index(box.lo.x, y, z),
                                       static_cast<std::size_t>(box.hi.x - box.lo.x));
      for (const Density d : row) highest = std::max(highest, d);
    }
  }
  const std::size_t at = grid_.index(cell.x, cell.y, cell.z);
  const std::uint8_t before = active_[at];
  active_[at] = highest >= iso_ ? 1 : 0;
  return active_[at] != before;
}

VoxelBox Macrocells::update_bricks(const BrickGrid& bricks, std::span<const std::uint32_t> changed,
                                   std::span<const Density> density) {
  const std::int32_t per_brick = kBrickEdge / edge_;
  // Samples of a cell reach a voxel beyond it, so that bricks side by side share cells: each once.
  std::vector<std::size_t> touched;
  for (const std::uint32_t id : changed) {
    const VoxelIndex at = bricks.brick(id);
    const auto beyond = [&](std::int32_t brick) { return (brick + 1) * per_brick + 1; };
    const VoxelBox cells = VoxelBox{
        {at.x * per_brick, at.y * per_brick, at.z * per_brick},
        {beyond(at.x), beyond(at.y),
         beyond(at.z)}}.clipped(grid_.box());
    for_each_voxel(cells, [&](int x, int y, int z) { touched.push_back(grid_.index(x, y, z)); });
  }
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  VoxelBox flipped;
  for (const std::size_t cell : touched) {
    const auto i = static_cast<std::int32_t>(cell);
    const VoxelIndex at{i % grid_.nx, i / grid_.nx % grid_.ny, i / grid_.nx / grid_.ny};
    if (!update_cell(at, density)) continue;
    flipped = flipped.united({at, {at.x + 1, at.y + 1, at.z + 1}});
  }
  return flipped;
}

std::vector<std::array<std::uint16_t, 4>> Macrocells::boundary_faces(const VoxelBox& cells) const {
  constexpr std::array<VoxelIndex, 6> kNeighbour{
      {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};
  const auto is_active = [this](VoxelIndex c) {
    return grid_.contains(c) && active_[grid_.index(c.x, c.y, c.z)] != 0;
  };
  std::vector<std::array<std::uint16_t, 4>> faces;
  for_each_voxel(cells, [&](int x, int y, int z) {
    if (!is_active({x, y, z})) return;
    for (std::size_t face = 0; face < kNeighbour.size(); ++face) {
      const VoxelIndex n = kNeighbour[face];
      if (is_active({x + n.x, y + n.y, z + n.z})) continue;
      faces.push_back({static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                       static_cast<std::uint16_t>(z), static_cast<std::uint16_t>(face)});
    }
  });
  return faces;
}

}  // namespace kerf
