// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
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
///
/// Refers to the labels, which do not change.
class MaterialTexels {
 public:
  MaterialTexels(const VoxelGrid& grid, std::span<const Label> labels, const Palette& palette);

  /// Of a brick of a whole volume, or of any box; x fastest.
  [[nodiscard]] std::vector<MaterialTexel> of(const VoxelBox& box,
                                              std::span<const Density> density) const;
  /// Of all of it.
  [[nodiscard]] std::vector<MaterialTexel> of_all(std::span<const Density> density) const;

 private:
  [[nodiscard]] bool any_label(const VoxelBox& box) const;
  [[nodiscard]] std::optional<glm::vec4> mean_around(VoxelIndex at) const;
  /// Calls `put(voxel, texel)` for each voxel of the box.
  template <class Put>
  void each(const VoxelBox& box, std::span<const Density> density, const Put& put) const;

  VoxelGrid grid_;
  std::span<const Label> labels_;
  std::array<glm::vec4, kPaletteWidth> label_looks_;
  std::array<MaterialTexel, kPaletteWidth> by_density_{}, by_label_{};
};

}  // namespace kerf
