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
  central,  ///< the difference over two voxel edges along each axis: sharp and rough
  corners,  ///< the same, of means over two voxel edges along the others: calms steps of a cut
  farid5,   ///< from 5x5x5 voxels, as the servo does: the calmest, blurs over four edges
};

/// All of them, as on the command line, in the order of the enumeration.
inline constexpr std::array<std::string_view, 3> kGradientNames{"central", "corners", "farid5"};
[[nodiscard]] constexpr std::string_view name_of(GradientFilter gradient) noexcept {
  return kGradientNames[static_cast<std::size_t>(gradient)];
}
/// Throws VisualizerError for an unknown name, and names the known.
[[nodiscard]] GradientFilter gradient_named(std::string_view name);

/// One axis takes `slope`, the others `smooth`, from two voxels before to two after; the sum is
/// divided by what a step from air to full density over two edges gives, so that this has the
/// gradient 1.
struct FilterTaps {
  std::array<float, 5> smooth, slope;
  float divisor;
};
/// farid5: Farid and Simoncelli, "Differentiation of discrete multidimensional signals", IEEE
/// Trans. Image Processing 13(4), 2004; in the integers of the servo.
[[nodiscard]] constexpr FilterTaps gradient_taps(GradientFilter kind) noexcept {
  constexpr auto kFull = static_cast<float>(kDensityMax);
  switch (kind) {
    case GradientFilter::central:
      return {{0, 0, 1, 0, 0}, {0, -1, 0, 1, 0}, kFull};
    case GradientFilter::corners:
      return {{0, 1, 0, 1, 0}, {0, -1, 0, 1, 0}, 4.0F * kFull};
    case GradientFilter::farid5:
      break;
  }
  // 129 is the sum of the smooth taps, 126 what the slope makes of a ramp of one step per edge.
  return {{5, 32, 55, 32, 5}, {-14, -35, 0, 35, 14}, 0.5F * 126.0F * 129.0F * 129.0F * kFull};
}

/// Voxels to each side that the gradient of a voxel depends on.
[[nodiscard]] constexpr std::int32_t gradient_reach(GradientFilter kind) noexcept {
  return kind == GradientFilter::farid5 ? 2 : 1;
}

/// Fills `gradients` for the voxels of `box` out of a whole volume, x fastest, with air around it.
/// The gradient of a voxel has the same bits whatever the box.
void fill_gradients(GradientFilter kind, const VoxelGrid& grid, std::span<const Density> density,
                    const VoxelBox& box, std::vector<glm::vec3>& gradients);

}  // namespace kerf
