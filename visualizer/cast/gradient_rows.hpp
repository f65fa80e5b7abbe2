// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "visualizer/cast/paired_rows.hpp"

namespace kerf {

/// The density gradient at each voxel, for rays that need it often: differences over two voxel
/// edges along one axis, means of four along the others, as iso.frag takes them. Interpolated they
/// are the gradient of that cube at any place, but for their 8 bits. In a border of none, as the
/// density: voxel v is at v + 1.
///
///     entry = byte x | byte y << 8 | byte z << 16,   byte = 128 + 127 * difference
class GradientRows {
 public:
  using Densities = PairedRows<Density, std::uint32_t>;

  GradientRows(VoxelGrid grid, const Densities& density);

  /// Call after the density of `box` has changed.
  void update(const VoxelBox& box, const Densities& density);

  [[nodiscard]] const std::uint32_t* data() const noexcept { return entries_.data(); }
  [[nodiscard]] std::int32_t row() const noexcept { return grid_.nx + 2; }
  [[nodiscard]] std::int32_t plane() const noexcept { return row() * (grid_.ny + 2); }

 private:
  void fill_row(std::int32_t y, std::int32_t z, const VoxelBox& box, const Densities& density);

  VoxelGrid grid_;
  std::vector<std::uint32_t> entries_;
};

}  // namespace kerf
