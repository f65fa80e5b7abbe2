// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// How the gradient of the density is estimated, which is the normal of what is shaded.
enum class GradientFilter : std::uint8_t {
  central,   ///< the difference over two voxel edges along each axis: sharp and rough
  corners,   ///< the same, of means over two voxel edges along the others: calms steps of a cut
  farid5,    ///< from 5x5x5 voxels, as the servo does: blurs over four edges
  adaptive,  ///< from 15x15x15 voxels where that and farid5 agree, else farid5
};

/// The means of `central` and `corners` let the highest frequency of the voxels through, `corners`
/// with the opposite sign: it draws a hatching on smooth surfaces. Cutting leaves voxels that are
/// nearly full or empty, whose steps `farid5` still shows as ripples; a wider filter alone would
/// round the edges.
inline constexpr GradientFilter kDefaultGradient = GradientFilter::adaptive;

/// All of them, as on the command line, in the order of the enumeration.
inline constexpr std::array<std::string_view, 4> kGradientNames{"central", "corners", "farid5",
                                                                "adaptive"};
[[nodiscard]] constexpr std::string_view name_of(GradientFilter gradient) noexcept {
  return kGradientNames[static_cast<std::size_t>(gradient)];
}
/// Throws VisualizerError for an unknown name, and names the known.
[[nodiscard]] GradientFilter gradient_named(std::string_view name);

/// One axis takes `slope`, the others `smooth`, from seven voxels before to seven after; the sum is
/// divided by what a step from air to full density over two edges gives, so that this has the
/// gradient 1.
struct FilterTaps {
  std::array<float, 15> smooth, slope;
  float divisor;
};
/// farid5: Farid and Simoncelli, "Differentiation of discrete multidimensional signals", IEEE
/// Trans. Image Processing 13(4), 2004; in the integers of the servo. adaptive: its wide filter,
/// means over 5, 5 and 7 voxels, a quadratic spline whose spread is that of a Gaussian of 2.8.
/// Where a cut sphere is parallel to the voxels its steps are terraces sqrt(2 R) voxels long: 3, 5
/// and 5 leave 3.9 degrees of those of R = 28 at 99 of 100 points, this leaves 2.
[[nodiscard]] constexpr FilterTaps gradient_taps(GradientFilter kind) noexcept {
  constexpr auto kFull = static_cast<float>(kDensityMax);
  switch (kind) {
    case GradientFilter::central:
      return {{0, 0, 0, 0, 0, 0, 0, 1}, {0, 0, 0, 0, 0, 0, -1, 0, 1}, kFull};
    case GradientFilter::corners:
      return {{0, 0, 0, 0, 0, 0, 1, 0, 1}, {0, 0, 0, 0, 0, 0, -1, 0, 1}, 4.0F * kFull};
    case GradientFilter::farid5:
      // 129 is the sum of the smooth taps, 126 what the slope makes of a ramp of one step per edge.
      return {{0, 0, 0, 0, 0, 5, 32, 55, 32, 5},
              {0, 0, 0, 0, 0, -14, -35, 0, 35, 14},
              0.5F * 126.0F * 129.0F * 129.0F * kFull};
    case GradientFilter::adaptive:
      break;
  }
  return {{1, 3, 6, 10, 15, 19, 22, 23, 22, 19, 15, 10, 6, 3, 1},
          {-1, -2, -2, -2, -2, -2, -2, 0, 2, 2, 2, 2, 2, 2, 1},
          0.5F * 98.0F * 175.0F * 175.0F * kFull};
}

/// Voxels to each side that the gradient of a voxel depends on.
[[nodiscard]] constexpr std::int32_t gradient_reach(GradientFilter kind) noexcept {
  return kind == GradientFilter::adaptive ? 7 : kind == GradientFilter::farid5 ? 2 : 1;
}

/// Fills `gradients` for the voxels of `box` out of a whole volume, x fastest, with air around it.
/// The gradient of a voxel has the same bits whatever the box.
void fill_gradients(GradientFilter kind, const VoxelGrid& grid, std::span<const Density> density,
                    const VoxelBox& box, std::vector<glm::vec3>& gradients);

}  // namespace kerf
