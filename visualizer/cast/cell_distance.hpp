// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "visualizer/macrocells.hpp"

namespace kerf {

/// How many macrocells around each one are empty: 0 for an active cell, d where no cell less than d
/// away (the largest of the three differences) is active. So a ray leaps over 2d - 1 cells at once.
///
/// A cell that becomes active lowers what is around it. One that becomes empty only sets itself to
/// 1: a distance that is too small costs time and never changes the picture.
class CellDistance {
 public:
  static constexpr std::int32_t kFarthest = 8;

  explicit CellDistance(const Macrocells& cells);

  /// Call after `cells.update_brick(at, ...)`.
  void update_brick(VoxelIndex at, const Macrocells& cells);

  /// One byte per cell, x fastest, and a few more: a load may read beyond the last.
  [[nodiscard]] const std::uint8_t* data() const noexcept { return distance_.data(); }

 private:
  void lower_around(VoxelIndex cell);

  VoxelGrid grid_;
  std::vector<std::uint8_t> distance_;
};

}  // namespace kerf
