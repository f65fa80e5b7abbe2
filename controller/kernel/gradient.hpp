// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "shared/numeric/numbers.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// How the density gradient is estimated (docs/forces.md 7.2); each kernel spans 5x5x5 voxels.
enum class GradientKernel : std::uint8_t {
  central,  ///< central difference, two voxels: cheap and rough
  sobel5,   ///< binomial smoothing
  farid,    ///< Farid and Simoncelli's optimal derivative in integers: the smallest direction error
};

/// One axis takes `slope`, the two others `smooth`; the sum is divided by 2^shift. `smooth` is
/// symmetric, `slope` antisymmetric. A ramp of one step per voxel gives 1 (farid: 0.999816).
struct GradientTaps {
  std::array<std::int32_t, 5> smooth;
  std::array<std::int32_t, 5> slope;
  int shift;
};

[[nodiscard]] constexpr GradientTaps taps(GradientKernel kernel) noexcept {
  switch (kernel) {
    case GradientKernel::central:
      return {{0, 0, 1, 0, 0}, {0, -1, 0, 1, 0}, 1};
    case GradientKernel::sobel5:
      return {{1, 4, 6, 4, 1}, {-1, -2, 0, 2, 1}, 11};
    case GradientKernel::farid:
      break;
  }
  return {{5, 32, 55, 32, 5}, {-14, -35, 0, 35, 14}, 21};
}

/// Voxels to each side that a gradient depends on.
inline constexpr std::int32_t kGradientReach = 2;

/// Gradient of one voxel, in density steps per voxel edge along each voxel axis.
template <class N>
struct Gradient {
  typename N::Gradient x{}, y{}, z{};
  friend constexpr bool operator==(const Gradient&, const Gradient&) noexcept = default;
};

/// From the exact tap sum: one rounding, half up in fixed. Only the central difference of 65535 can
/// leave the 16 bits, by half a step: it stays at 32767.
template <class N>
[[nodiscard]] constexpr typename N::Gradient gradient_from_sum(std::int64_t sum,
                                                               int shift) noexcept {
  using Value = typename N::Gradient;
  if constexpr (N::kIsFixed) {
    constexpr std::int64_t kMax = std::numeric_limits<Value>::max();
    return static_cast<Value>(std::min(round_shift(sum, shift), kMax));
  } else {
    return static_cast<Value>(sum) / static_cast<Value>(std::int64_t{1} << shift);
  }
}

/// Working memory of `refresh_gradients`: 70 800 bytes whatever the box. Caller-owned, any
/// contents.
struct GradientScratch {
  static constexpr std::size_t kTile = 32;  ///< a box of a 16-voxel tool is one tile
  static constexpr std::size_t kHalo = kTile + 2 * kGradientReach;
  using Row = std::array<std::int32_t, kTile>;

  /// One z plane of a tile, filtered along x and y; named by the axis that took the slope.
  struct Plane {
    std::array<Row, kTile> slope_x, slope_y, smooth;
  };

  std::array<std::int32_t, kHalo> line;      ///< densities of one row, 0 outside the volume
  std::array<Row, kHalo> smooth_x, slope_x;  ///< rows of one plane, filtered along x
  std::array<Plane, 5> planes;               ///< the planes z-2 .. z+2, by z modulo 5
};

namespace detail {

// The taps are (anti)symmetric, so five products become three or two.
template <class Wide>
[[nodiscard]] constexpr Wide smooth5(const GradientTaps& tap, Wide a, Wide b, Wide c, Wide d,
                                     Wide e) noexcept {
  return tap.smooth[2] * c + tap.smooth[1] * (b + d) + tap.smooth[0] * (a + e);
}
template <class Wide>
[[nodiscard]] constexpr Wide slope5(const GradientTaps& tap, Wide a, Wide b, Wide d,
                                    Wide e) noexcept {
  return tap.slope[3] * (d - b) + tap.slope[4] * (e - a);
}

/// Filters plane z of the tile along x, then y. At most 129^2 * 65535 = 1.09e9: fits 32 bits.
constexpr void filter_plane(const GradientTaps& tap, const VoxelGrid& grid,
                            std::span<const Density> density, const VoxelBox& tile, std::int32_t z,
                            GradientScratch& scratch, GradientScratch::Plane& plane) noexcept {
  const auto width = static_cast<std::size_t>(tile.hi.x - tile.lo.x);
  const auto height = static_cast<std::size_t>(tile.hi.y - tile.lo.y);
  const std::int32_t first_x = tile.lo.x - kGradientReach;
  const std::int32_t from = std::max(first_x, std::int32_t{0});
  const std::int32_t to = std::min(tile.hi.x + kGradientReach, grid.nx);
  const auto before = static_cast<std::size_t>(from - first_x);
  const auto count = static_cast<std::size_t>(to - from);
  auto& line = scratch.line;
  line.fill(0);
  for (std::size_t row = 0; row < height + 2 * kGradientReach; ++row) {
    const std::int32_t y = tile.lo.y - kGradientReach + static_cast<std::int32_t>(row);
    auto& smooth = scratch.smooth_x[row];
    auto& slope = scratch.slope_x[row];
    if (z < 0 || z >= grid.nz || y < 0 || y >= grid.ny) {
      smooth.fill(0);
      slope.fill(0);
      continue;
    }
    const std::span<const Density> source = density.subspan(grid.index(from, y, z), count);
    for (std::size_t i = 0; i < count; ++i) line[before + i] = source[i];
    for (std::size_t i = 0; i < width; ++i) {
      smooth[i] = smooth5(tap, line[i], line[i + 1], line[i + 2], line[i + 3], line[i + 4]);
      slope[i] = slope5(tap, line[i], line[i + 1], line[i + 3], line[i + 4]);
    }
  }
  for (std::size_t j = 0; j < height; ++j) {
    const auto* s = &scratch.smooth_x[j];
    const auto* d = &scratch.slope_x[j];
    for (std::size_t i = 0; i < width; ++i) {
      plane.smooth[j][i] = smooth5(tap, s[0][i], s[1][i], s[2][i], s[3][i], s[4][i]);
      plane.slope_y[j][i] = slope5(tap, s[0][i], s[1][i], s[3][i], s[4][i]);
      plane.slope_x[j][i] = smooth5(tap, d[0][i], d[1][i], d[2][i], d[3][i], d[4][i]);
    }
  }
}

/// Filters five planes along z and stores the gradients of the middle one.
template <class N>
constexpr void store_plane(const GradientTaps& tap, const VoxelGrid& grid, const VoxelBox& tile,
                           std::int32_t z, const std::array<const GradientScratch::Plane*, 5>& p,
                           std::span<Gradient<N>> field) noexcept {
  const auto wide = [](std::int32_t v) { return std::int64_t{v}; };
  const auto width = static_cast<std::size_t>(tile.hi.x - tile.lo.x);
  const auto height = static_cast<std::size_t>(tile.hi.y - tile.lo.y);
  for (std::size_t j = 0; j < height; ++j) {
    const std::int32_t y = tile.lo.y + static_cast<std::int32_t>(j);
    const std::span<Gradient<N>> out = field.subspan(grid.index(tile.lo.x, y, z), width);
    for (std::size_t i = 0; i < width; ++i) {
      const std::int64_t x_sum =
          smooth5(tap, wide(p[0]->slope_x[j][i]), wide(p[1]->slope_x[j][i]),
                  wide(p[2]->slope_x[j][i]), wide(p[3]->slope_x[j][i]), wide(p[4]->slope_x[j][i]));
      const std::int64_t y_sum =
          smooth5(tap, wide(p[0]->slope_y[j][i]), wide(p[1]->slope_y[j][i]),
                  wide(p[2]->slope_y[j][i]), wide(p[3]->slope_y[j][i]), wide(p[4]->slope_y[j][i]));
      const std::int64_t z_sum = slope5(tap, wide(p[0]->smooth[j][i]), wide(p[1]->smooth[j][i]),
                                        wide(p[3]->smooth[j][i]), wide(p[4]->smooth[j][i]));
      out[i] = {gradient_from_sum<N>(x_sum, tap.shift), gradient_from_sum<N>(y_sum, tap.shift),
                gradient_from_sum<N>(z_sum, tap.shift)};
    }
  }
}

}  // namespace detail

/// Recomputes every gradient that depends on the density in `changed`: the box grown by
/// kGradientReach and clipped to the volume. `grid.box()` makes the whole field.
///
/// Separable, tile by tile, marching along z; the intermediate sums are exact, so the bits are
/// those of the plain sum over 5x5x5 densities. Bounded by the box; an empty box does nothing.
/// `field` and `density` hold one entry per voxel.
template <class N>
constexpr void refresh_gradients(GradientKernel kernel, const VoxelGrid& grid,
                                 std::span<const Density> density, const VoxelBox& changed,
                                 std::span<Gradient<N>> field, GradientScratch& scratch) noexcept {
  if (changed.empty()) return;
  const GradientTaps tap = taps(kernel);
  const VoxelBox box = changed.grown(kGradientReach).clipped(grid.box());
  constexpr auto kTile = static_cast<std::int32_t>(GradientScratch::kTile);
  const auto plane = [&](std::int32_t z) -> GradientScratch::Plane& {
    return scratch.planes[static_cast<std::size_t>(z + kGradientReach) % 5];  // z >= -2
  };
  for (std::int32_t y = box.lo.y; y < box.hi.y; y += kTile) {
    for (std::int32_t x = box.lo.x; x < box.hi.x; x += kTile) {
      const VoxelBox tile =
          VoxelBox{{x, y, box.lo.z}, {x + kTile, y + kTile, box.hi.z}}.clipped(box);
      for (std::int32_t z = box.lo.z - kGradientReach; z < box.hi.z + kGradientReach; ++z) {
        detail::filter_plane(tap, grid, density, tile, z, scratch, plane(z));
        const std::int32_t middle = z - kGradientReach;
        if (middle < box.lo.z) continue;
        detail::store_plane<N>(tap, grid, tile, middle,
                               {&plane(middle - 2), &plane(middle - 1), &plane(middle),
                                &plane(middle + 1), &plane(middle + 2)},
                               field);
      }
    }
  }
}

}  // namespace kerf
