// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

#include "shared/volume/brick_grid.hpp"
#include "shared/volume/changed_bricks.hpp"
#include "shared/volume/voxel_grid.hpp"
#include "visualizer/scene/filter_kernels.hpp"

namespace kerf {

/// How the gradient of the density is estimated, which is the normal of what is shaded.
enum class GradientFilter : std::uint8_t {
  central,  ///< the difference over two voxel edges along each axis: sharp and rough
  corners,  ///< central, of means over two voxel edges along the other axes: smooths steps of a cut
  farid5,   ///< from 5x5x5 voxels, as the servo does: blurs over four edges
  adaptive,  ///< from 15x15x15 voxels where that and farid5 agree, else farid5; unequal voxels:
             ///< from as many mm along each axis
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

/// A filter along one axis, from `reach` voxels before `kMiddle` to `reach` after it: the axis of a
/// gradient's part takes `slope`, the others `smooth`.
struct AxisTaps {
  static constexpr std::int32_t kMiddle = 10;
  std::array<float, 2 * kMiddle + 1> smooth{}, slope{};
  float smooth_sum = 1.0F;
  float slope_sum = 2.0F;  ///< what the slope makes of a ramp of one step per edge
  std::int32_t reach = 0;
};
using FilterTaps = std::array<AxisTaps, 3>;  ///< by axis

/// From this gradient on a sample inside a volume is lit as a surface by more than half
/// (translucent_sample.frag), in units of `GradientPlan`.
inline constexpr double kSurfaceSlope = 0.12;

/// How the gradients of one volume are computed. A gradient is counted in units of a step from air
/// to full density over two edges: of the voxel along each axis, or, by `adaptive`, of the longest
/// one along all axes, so that what lies between two voxels is the mean of their directions.
///
/// Derivatives along the three axes make a direction if all three see the volume through one
/// smoothing; it turns no plane, however long it is, and no ball if it is equally long in mm along
/// each axis. One of 15 voxels along each axis turns a ball of 28x28x2.8 voxels by 30 degrees at 99
/// of 100 points. So `adaptive` gathers unequal voxels into cells that are nearly cubes, filters
/// these by mm, and takes for a voxel what lies between their centres.
struct GradientPlan {
  /// `edges_mm` of a voxel: only their ratios matter, and only for `adaptive`.
  explicit GradientPlan(GradientFilter filter, const glm::dvec3& edges_mm = glm::dvec3(1.0));

  [[nodiscard]] bool has_cells() const noexcept { return cell != VoxelIndex{1, 1, 1}; }
  /// Voxels to each side, by axis, that the gradient of a voxel depends on.
  [[nodiscard]] VoxelIndex reach() const noexcept;
  /// The voxels whose gradient depends on one in `box`.
  [[nodiscard]] VoxelBox around(const VoxelBox& box) const noexcept;
  /// The voxels of the volume whose gradient depends on a changed one, in boxes that may overlap.
  /// Bricks side by side share most of what is around them: what is around several is one box if
  /// that has no more voxels than theirs, and no more than 64^3.
  [[nodiscard]] std::vector<VoxelBox> around(const ChangedBricks& changed,
                                             const BrickGrid& bricks) const;

  GradientFilter filter;
  FilterTaps voxel{};           ///< of the voxels; adaptive: used if there are cells
  FilterTaps narrow{}, wide{};  ///< adaptive: of the cells
  VoxelIndex cell{1, 1, 1};     ///< adaptive: voxels of a cell, by axis
  glm::vec3 per_edge{1.0F};     ///< times this, a gradient is one per voxel edge
  /// How deep below a surface, a step from air to full density, the gradient is `kSurfaceSlope`: by
  /// `adaptive` that of the narrow filter, whose length it has.
  double surface_mm = 0.0;
};

/// What `fill_gradients` computes with; a caller that keeps it allocates once.
struct GradientWork {
  const FilterKernels* kernels = filter_kernels()[0];
  std::vector<std::vector<float>> fields;
};

/// Fills `gradients` for the voxels of `box` out of a whole volume, x fastest, with air around it.
/// The gradient of a voxel has the same bits whatever the box, and by all kernels.
void fill_gradients(const GradientPlan& plan, const VoxelGrid& grid,
                    std::span<const Density> density, const VoxelBox& box,
                    std::vector<glm::vec3>& gradients, GradientWork& work);

/// Fills gradients with temporary memory.
inline void fill_gradients(const GradientPlan& plan, const VoxelGrid& grid,
                           std::span<const Density> density, const VoxelBox& box,
                           std::vector<glm::vec3>& gradients) {
  GradientWork work;
  fill_gradients(plan, grid, density, box, gradients, work);
}

/// `box` larger by as many voxels on both sides.
[[nodiscard]] constexpr VoxelBox grown(const VoxelBox& box, const VoxelIndex& by) noexcept {
  return {{box.lo.x - by.x, box.lo.y - by.y, box.lo.z - by.z},
          {box.hi.x + by.x, box.hi.y + by.y, box.hi.z + by.z}};
}

}  // namespace kerf
