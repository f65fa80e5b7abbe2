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

/// The density gradient at each voxel, for all that shades surfaces: on the processor, on
/// the GPU, at the vertices of a mesh, and to find out what of a picture must be drawn again.
/// Interpolated between voxels. Around the volume is a border one voxel wide, of air: voxel v is at
/// v + 1. It has gradients, too: the face of a volume one voxel thick lies between its voxel, whose
/// gradient is 0, and the border.
class GradientRows {
 public:
  /// 32768 + 32767 g along each axis, g in -1..1; the last is nothing. GL's RGBA16.
  using Entry = std::array<std::uint16_t, 4>;
  static constexpr Entry kNone{32768, 32768, 32768, 0};

  /// Throws std::bad_alloc.
  GradientRows(const GradientPlan& plan, const VoxelGrid& grid, std::span<const Density> density);

  /// What a volume of this extent takes.
  [[nodiscard]] static std::size_t entry_count(const VoxelGrid& grid) noexcept;

  /// Call after voxels have `changed` in `density`, which is all of the volume. Returns the voxels,
  /// and what of the border, whose gradients may have.
  std::vector<VoxelBox> update(const ChangedBricks& changed, std::span<const Density> density);

  [[nodiscard]] const GradientPlan& plan() const noexcept { return plan_; }
  /// Of a voxel, or of the border.
  [[nodiscard]] glm::vec3 at(const VoxelIndex& voxel) const noexcept;
  /// As the kernels take it; good as long as this object.
  [[nodiscard]] CastGradient view() const noexcept;
  [[nodiscard]] const Entry* data() const noexcept { return entries_.data(); }

 private:
  struct Work {
    std::vector<glm::vec3> gradients;  ///< of the last box
    GradientWork filters;
  };
  void fill(const VoxelBox& box, std::span<const Density> density, Work& work);
  /// In `entries_`, of a voxel or of the border.
  [[nodiscard]] std::size_t place(const VoxelIndex& voxel) const noexcept;

  GradientPlan plan_;
  VoxelGrid grid_;
  std::vector<Entry> entries_;
  Work work_;
};

}  // namespace kerf
