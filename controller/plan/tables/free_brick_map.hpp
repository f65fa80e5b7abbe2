// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "controller/kernel/point_shell/free_bricks.hpp"

namespace kerf {

/// Owner of a volume's FreeBricks. Load time; moving it keeps the map valid.
class FreeBrickMap {
 public:
  /// A voxel counts when its density reaches `faintest`, below which contact feels nothing. While
  /// the map is made it takes half a byte more for each voxel.
  FreeBrickMap(const VoxelGrid& grid, std::span<const Density> density, Density faintest);

  [[nodiscard]] FreeBricks bricks() const noexcept { return {grid_, distance_.data()}; }
  [[nodiscard]] std::size_t bytes() const noexcept { return distance_.size(); }

 private:
  VoxelGrid grid_;
  std::vector<std::uint8_t> distance_;
};

}  // namespace kerf
