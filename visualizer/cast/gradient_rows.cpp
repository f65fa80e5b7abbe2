// SPDX-License-Identifier: Apache-2.0
#include "visualizer/cast/gradient_rows.hpp"

namespace kerf {

namespace {

constexpr std::uint32_t kNoGradient = 0x00808080;

/// 128 + 127 * sum / (four differences of the highest density).
std::uint32_t byte_of(std::int32_t sum) {
  constexpr float kScale = 127.0F / (4.0F * static_cast<float>(kDensityMax));
  return static_cast<std::uint32_t>(static_cast<float>(sum) * kScale + 128.5F);
}

std::int32_t low(std::uint32_t entry) {
  return static_cast<std::int32_t>(entry & 0xffff);
}
std::int32_t high(std::uint32_t entry) {
  return static_cast<std::int32_t>(entry >> 16);
}

}  // namespace

GradientRows::GradientRows(VoxelGrid grid, const Densities& density)
    : grid_(grid),
      // A plane more: a cell beyond the last voxels is read and has no weight.
      entries_(static_cast<std::size_t>(grid.nx + 2) * static_cast<std::size_t>(grid.ny + 2) *
                   static_cast<std::size_t>(grid.nz + 3),
               kNoGradient) {
  update(grid.box(), density);
}

void GradientRows::update(const VoxelBox& box, const Densities& density) {
  const VoxelBox touched = box.grown(1).clipped(grid_.box());
  for (std::int32_t z = touched.lo.z; z < touched.hi.z; ++z) {
    for (std::int32_t y = touched.lo.y; y < touched.hi.y; ++y) fill_row(y, z, touched, density);
  }
}

void GradientRows::fill_row(std::int32_t y, std::int32_t z, const VoxelBox& box,
                            const Densities& density) {
  // In border coordinates voxel y is y + 1: the row before begins at y, and row y + 1 pairs that
  // voxel with the one after.
  const auto at = [&](std::int32_t row, std::int32_t plane) {
    return density.data() + static_cast<std::ptrdiff_t>(plane) * density.plane() +
           static_cast<std::ptrdiff_t>(row) * density.row();
  };
  const std::uint32_t* const low_z[2] = {at(y, z), at(y + 1, z)};
  const std::uint32_t* const high_z[2] = {at(y, z + 2), at(y + 1, z + 2)};
  std::uint32_t* const out = entries_.data() + static_cast<std::ptrdiff_t>(z + 1) * plane() +
                             static_cast<std::ptrdiff_t>(y + 1) * row();
  for (std::int32_t x = box.lo.x + 1; x <= box.hi.x; ++x) {
    std::int32_t sum[3] = {};
    for (const std::int32_t side : {-1, 1}) {
      const std::int32_t ll = low(low_z[0][x + side]);
      const std::int32_t hl = high(low_z[1][x + side]);
      const std::int32_t lh = low(high_z[0][x + side]);
      const std::int32_t hh = high(high_z[1][x + side]);
      sum[0] += side * (ll + hl + lh + hh);
      sum[1] += hl + hh - ll - lh;
      sum[2] += lh + hh - ll - hl;
    }
    out[x] = byte_of(sum[0]) | byte_of(sum[1]) << 8 | byte_of(sum[2]) << 16;
  }
}

}  // namespace kerf
