// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "shared/volume/voxel_grid.hpp"
#include "visualizer/cast/cast_kernels.hpp"
#include "visualizer/scene/gradient_plan.hpp"

namespace kerf {

/// The density gradient at each voxel. Ray caster, GPU renderers and meshes shade with it, and it
/// shows which pixels must be redrawn. Readers interpolate between voxels.
///
/// A border of air, one voxel wide, surrounds the volume, so voxel v has index v + 1. The border
/// has gradients because a surface may lie between it and the outermost voxel: in a volume one
/// voxel thick the voxels' own gradients are 0.
class GradientRows {
 public:
  /// 32768 + 32767 g along each axis, g in -1..1; the fourth number is unused. GL's RGBA16.
  using Entry = std::array<std::uint16_t, 4>;
  static constexpr Entry kNone{32768, 32768, 32768, 0};

  /// Throws std::bad_alloc.
  GradientRows(const GradientPlan& plan, const VoxelGrid& grid, std::span<const Density> density);

  /// What a volume of this extent takes.
  [[nodiscard]] static std::size_t entry_count(const VoxelGrid& grid) noexcept;

  /// Call after voxels have `changed` in `density`, the whole volume. Returns boxes with all
  /// voxels, of the border too, whose gradients may have changed.
  std::vector<VoxelBox> update(const ChangedBricks& changed, std::span<const Density> density);

  [[nodiscard]] const GradientPlan& plan() const noexcept { return plan_; }
  /// The gradient at a voxel of the volume or of the border.
  [[nodiscard]] glm::vec3 at(const VoxelIndex& voxel) const noexcept;
  /// For the kernels of the ray caster; valid as long as this object.
  [[nodiscard]] CastGradient view() const noexcept;
  [[nodiscard]] const Entry* data() const noexcept { return entries_.data(); }

 private:
  struct Work {
    std::vector<glm::vec3> gradients;  ///< of the last box
    GradientWork filters;
  };
  void fill(const VoxelBox& box, std::span<const Density> density, Work& work);
  /// Index in `entries_` of a voxel of the volume or of the border.
  [[nodiscard]] std::size_t place(const VoxelIndex& voxel) const noexcept;

  GradientPlan plan_;
  VoxelGrid grid_;
  std::vector<Entry> entries_;
  Work work_;
};

}  // namespace kerf
