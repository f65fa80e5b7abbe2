// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "visualizer/view/gradient.hpp"
#include "visualizer/view/transfer_function.hpp"

namespace kerf {

/// What the translucent renderers read at every sample, ready to be filtered: the gradient of the
/// density and the density itself, 8 bits each.
struct GradientTexel {
  std::uint8_t x, y, z;  ///< 128 + 127 g, g in -1..1
  std::uint8_t density;  ///< 255 = scene maximum

  friend constexpr bool operator==(const GradientTexel&, const GradientTexel&) noexcept = default;
};
inline constexpr GradientTexel kAirTexel{128, 128, 128, 0};

/// Fills `texels` for `box` out of a whole volume: `fill_gradients` and the densities.
void fill_gradient_texels(Gradient kind, const VoxelGrid& grid, std::span<const Density> density,
                          const VoxelBox& box, std::vector<GradientTexel>& texels);

/// Linear colour of the material and its opacity over one voxel edge, 8 bits each.
struct MaterialTexel {
  std::uint8_t r, g, b, opacity;

  friend constexpr bool operator==(const MaterialTexel&, const MaterialTexel&) noexcept = default;
};

/// The material of each voxel by its label. A voxel without one takes the mean of the labelled
/// voxels within two edges, so that a border which fades into the air keeps its colour; where there
/// are none either, the material of its density.
[[nodiscard]] std::vector<MaterialTexel> material_texels(const VoxelGrid& grid,
                                                         std::span<const Density> density,
                                                         std::span<const Label> labels,
                                                         const Palette& palette);

}  // namespace kerf
