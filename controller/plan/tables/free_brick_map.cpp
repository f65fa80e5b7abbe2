// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/tables/free_brick_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace kerf {
namespace {

// Brick b holds the points from 2b to 2b + 2; voxel v is read from v - 1 to v + 1. Between them are
// max(0, v - 2b - 3, 2b - 1 - v) voxels along an axis. The least sum of the squares over all voxels
// that count is taken axis by axis (Saito and Toriwaki 1994), exactly.

/// Of voxels; at most 64^2, as farther than the map can say.
using Square = std::int16_t;
constexpr std::int32_t kFar = 64;
constexpr Square kNone = kFar * kFar;

/// Squares along x of a row of voxels.
void square_row(std::span<const Density> row, Density faintest, std::span<Square> squares) {
  const auto bricks = static_cast<std::int32_t>(squares.size());
  const auto voxels = static_cast<std::int32_t>(row.size());
  const auto meet = [&](std::int32_t brick, std::int32_t gap) {
    Square& square = squares[static_cast<std::size_t>(brick)];
    square = std::min(square, static_cast<Square>(gap < kFar ? gap * gap : kNone));
  };
  std::fill(squares.begin(), squares.end(), kNone);
  std::int32_t last =
      -4 * kFar;  // voxel that counts, at or before the one that the brick ends with
  for (std::int32_t brick = 0, v = 0; brick < bricks; ++brick) {
    for (; v < std::min(voxels, kFreeBrick * brick + 4); ++v) {
      if (row[static_cast<std::size_t>(v)] >= faintest) last = v;
    }
    meet(brick, std::max(0, kFreeBrick * brick - 1 - last));
  }
  std::int32_t next = voxels + 4 * kFar;
  for (std::int32_t brick = bricks, v = voxels; brick-- > 0;) {
    for (; v > std::max(0, kFreeBrick * brick - 1);) {
      if (row[static_cast<std::size_t>(--v)] >= faintest) next = v;
    }
    meet(brick, std::max(0, next - kFreeBrick * brick - 3));
  }
}

/// From the squares at `lines` voxels along an axis, `width` numbers each, those at each brick.
void add_axis(std::span<const Square> at_voxels, std::size_t width, std::span<Square> at_bricks) {
  const auto lines = static_cast<std::int32_t>(at_voxels.size() / width);
  const auto bricks = static_cast<std::int32_t>(at_bricks.size() / width);
  std::vector<Square> least(static_cast<std::size_t>(lines));  // of each line
  for (std::size_t line = 0; line < least.size(); ++line) {
    const Square* const from = at_voxels.data() + line * width;
    least[line] = *std::min_element(from, from + width);
  }
  for (std::int32_t brick = 0; brick < bricks; ++brick) {
    Square* const to = at_bricks.data() + static_cast<std::size_t>(brick) * width;
    std::fill(to, to + width, kNone);
    Square most = kNone;  // of `to`
    const auto meet = [&](std::int32_t voxel, std::int32_t gap) {
      if (voxel < 0 || voxel >= lines) return;
      const auto more = static_cast<Square>(gap * gap);
      if (least[static_cast<std::size_t>(voxel)] + more >= most) return;
      const Square* const from = at_voxels.data() + static_cast<std::size_t>(voxel) * width;
      Square left = 0;
      for (std::size_t i = 0; i < width; ++i) {
        to[i] = std::min(to[i], static_cast<Square>(from[i] + more));
        left = std::max(left, to[i]);
      }
      most = left;
    };
    const std::int32_t low = kFreeBrick * brick - 1, high = kFreeBrick * brick + 3;
    for (std::int32_t voxel = low + 1; voxel < high; ++voxel) meet(voxel, 0);
    for (std::int32_t gap = 0; gap < kFar && gap * gap < most; ++gap) {
      meet(low - gap, gap);
      meet(high + gap, gap);
    }
  }
}

}  // namespace

FreeBrickMap::FreeBrickMap(const VoxelGrid& grid, std::span<const Density> density,
                           Density faintest)
    : grid_{(grid.nx + kFreeBrick - 1) / kFreeBrick, (grid.ny + kFreeBrick - 1) / kFreeBrick,
            (grid.nz + kFreeBrick - 1) / kFreeBrick},
      distance_(grid_.voxel_count()) {
  static_assert(kFreeBrick == 2 && kFar * kFreeSteps > kFreeFarthest);
  const auto count = [](std::int32_t n) { return static_cast<std::size_t>(n); };
  const std::size_t width = count(grid_.nx), layer = width * count(grid_.ny);
  std::vector<Square> rows(width * count(grid.ny)), layers(layer * count(grid.nz)),
      all(distance_.size());
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = 0; y < grid.ny; ++y) {
      square_row(density.subspan(grid.index(0, y, z), count(grid.nx)), faintest,
                 std::span(rows).subspan(count(y) * width, width));
    }
    add_axis(rows, width, std::span(layers).subspan(count(z) * layer, layer));
  }
  add_axis(layers, layer, all);
  std::vector<std::uint8_t> steps(kNone + 1);
  for (std::size_t square = 0; square < steps.size(); ++square) {
    steps[square] = static_cast<std::uint8_t>(
        std::min<double>(kFreeFarthest, std::floor(kFreeSteps * std::sqrt(double(square)))));
  }
  std::transform(all.begin(), all.end(), distance_.begin(),
                 [&](Square square) { return steps[static_cast<std::size_t>(square)]; });
}

void FreeBrickMap::raise_to(const FreeBrickMap& other, std::int32_t steps) {
  std::transform(distance_.begin(), distance_.end(), other.distance_.begin(), distance_.begin(),
                 [steps](std::uint8_t own, std::uint8_t others) {
                   return static_cast<std::uint8_t>(std::max<std::int32_t>(own, others - steps));
                 });
}

MappedField::MappedField(const VoxelGrid& grid, std::span<const Density> density, Density iso)
    : grid_(grid),
      density_(density.data()),
      iso_(iso),
      free_(grid, density, static_cast<Density>(iso / 8)) {  // r = 1/16
  free_.raise_to(FreeBrickMap(grid, density, iso), kIsoNearSteps);
}

}  // namespace kerf
