// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "visualizer/cast/macrocells.hpp"

namespace kerf {

/// `Macrocells::boundary_faces` in a list whose places change little when cells do, so that a copy
/// of it elsewhere follows by a few pieces.
class CellFaces {
 public:
  using Face = std::array<std::uint16_t, 4>;
  /// Places first <= i < end.
  struct Run {
    std::size_t first, end;
  };

  explicit CellFaces(const Macrocells& cells);

  /// Call after cells in `flipped` became active or inactive. Returns the places with another face
  /// now, ascending; places from the list's size on are no more.
  std::vector<Run> update(const Macrocells& cells, const VoxelBox& flipped);

  [[nodiscard]] std::span<const Face> all() const noexcept { return faces_; }
  /// As long as the list of a grid can get: where active and empty cells take turns, half of them
  /// have six.
  [[nodiscard]] static std::size_t most(const VoxelGrid& grid) noexcept {
    return 3 * (grid.voxel_count() + 1);
  }
  /// In cells, the smallest box that holds every active one.
  [[nodiscard]] VoxelBox active_box() const;

 private:
  std::vector<Face> faces_;
};

}  // namespace kerf
