// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>

#include <glm/glm.hpp>

#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// A point in a volume: voxel coordinates in steps of 1/4096. Whole numbers, so that two bricks
/// that meet compute the same point on every machine.
using FinePoint = glm::ivec3;
/// Its corners.
using FineTriangle = std::array<FinePoint, 3>;
inline constexpr int kFineLog2 = 12;
inline constexpr int kFinePerVoxel = 1 << kFineLog2;

/// Densities and labels of a volume between its voxels; air without a label surrounds it. Spans of
/// the caller, x fastest.
struct VolumeSamples {
  VoxelGrid grid;
  std::span<const Density> density;
  std::span<const Label> labels;  ///< empty, or one per voxel

  [[nodiscard]] Density density_at(VoxelIndex v) const noexcept {
    return grid.contains(v) ? density[grid.index(v.x, v.y, v.z)] : Density{0};
  }
  [[nodiscard]] Label label_at(VoxelIndex v) const noexcept {
    return grid.contains(v) ? labels[grid.index(v.x, v.y, v.z)] : Label{0};
  }
  /// Trilinear, 0..65535; each of the three steps rounds down.
  [[nodiscard]] int density_at(FinePoint p) const noexcept {
    const VoxelIndex v = voxel_below(p);
    if (!grid.contains(v) || v.x + 1 >= grid.nx || v.y + 1 >= grid.ny || v.z + 1 >= grid.nz) {
      return blend(p, [&](int x, int y, int z) {
        return int{density_at(VoxelIndex{v.x + x, v.y + y, v.z + z})};
      });
    }
    const std::ptrdiff_t row = grid.nx;
    const std::ptrdiff_t layer = row * grid.ny;
    const Density* at = &density[grid.index(v.x, v.y, v.z)];
    return blend(p, [&](int x, int y, int z) { return int{at[x + y * row + z * layer]}; });
  }

  [[nodiscard]] static VoxelIndex voxel_below(FinePoint p) noexcept {
    return {p.x >> kFineLog2, p.y >> kFineLog2, p.z >> kFineLog2};
  }

 private:
  template <typename Corner>
  [[nodiscard]] static int blend(FinePoint p, const Corner& corner) noexcept {
    const glm::ivec3 fraction = p & (kFinePerVoxel - 1);
    const auto lerp = [](int a, int b, int t) { return a + ((b - a) * t >> kFineLog2); };
    const auto row = [&](int y, int z) {
      return lerp(corner(0, y, z), corner(1, y, z), fraction.x);
    };
    return lerp(lerp(row(0, 0), row(1, 0), fraction.y), lerp(row(0, 1), row(1, 1), fraction.y),
                fraction.z);
  }
};

}  // namespace kerf
