// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "shared/volume/voxel_grid.hpp"
#include "visualizer/cast/cast_kernels.hpp"
#include "visualizer/cast/gradient_rows.hpp"
#include "visualizer/cast/macrocells.hpp"
#include "visualizer/scene/appearance.hpp"
#include "visualizer/scene/camera.hpp"
#include "visualizer/scene/scene_view.hpp"

namespace kerf {

/// A volume for trilinear sampling: in a border of air one voxel thick, and each voxel together
/// with the next one in y, so that one load of two entries brings four corners of a cell. That
/// costs twice the memory and halves the loads, which set the pace of a ray caster.
///
///     entry (x, y, z) = voxel (x-1, y-1, z-1) | voxel (x-1, y, z-1) << bits of a voxel
template <class Voxel, class Entry>
class PairedRows {
 public:
  static_assert(sizeof(Entry) == 2 * sizeof(Voxel));

  /// Throws std::bad_alloc. All air.
  explicit PairedRows(VoxelGrid grid) : grid_(grid), entries_(entry_count(grid)) {}

  /// What a volume of this extent takes.
  [[nodiscard]] static std::size_t entry_count(VoxelGrid grid) {
    // One plane of air beyond the border, for cubes around its last voxels, and a little more: a
    // load may read beyond its last entry.
    return static_cast<std::size_t>(grid.nx + 2) * static_cast<std::size_t>(grid.ny + 1) *
               static_cast<std::size_t>(grid.nz + 3) +
           sizeof(std::uint64_t) / sizeof(Entry);
  }

  /// Takes the voxels of `box` from a whole volume, x fastest.
  void copy(const VoxelBox& box, std::span<const Voxel> volume) {
    constexpr int kBits = 8 * sizeof(Voxel);
    for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
      for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
        const Voxel* from = volume.data() + grid_.index(box.lo.x, y, z);
        Entry* own = entries_.data() + at(box.lo.x + 1, y + 1, z + 1);
        Entry* before = entries_.data() + at(box.lo.x + 1, y, z + 1);
        for (std::int32_t i = 0; i < box.hi.x - box.lo.x; ++i) {
          const auto voxel = static_cast<Entry>(from[i]);
          constexpr auto kLow = static_cast<Entry>((Entry{1} << kBits) - 1);
          own[i] = static_cast<Entry>((own[i] & ~kLow) | voxel);
          before[i] = static_cast<Entry>((before[i] & kLow) | voxel << kBits);
        }
      }
    }
  }

  [[nodiscard]] const Entry* data() const noexcept { return entries_.data(); }
  [[nodiscard]] std::int32_t row() const noexcept { return grid_.nx + 2; }
  [[nodiscard]] std::int32_t plane() const noexcept { return row() * (grid_.ny + 1); }

 private:
  [[nodiscard]] std::size_t at(std::int32_t x, std::int32_t y, std::int32_t z) const noexcept {
    return static_cast<std::size_t>(z) * static_cast<std::size_t>(plane()) +
           static_cast<std::size_t>(y) * static_cast<std::size_t>(row()) +
           static_cast<std::size_t>(x);
  }

  VoxelGrid grid_;
  std::vector<Entry> entries_;
};

/// `view` as the kernels take it, for a picture of `width` x `height` pixels.
[[nodiscard]] CastEye cast_eye(const View& view, std::int32_t width, std::int32_t height);

/// `from` into what the kernels read.
void put(float (&to)[3], const glm::dvec3& from);
/// [to][from], so that a row makes one part of a place.
void put(float (&to)[3][3], const glm::dmat3& from);

/// Rays end at the iso-surface, or go on through what is translucent.
enum class CastMode : std::uint8_t { iso, blend };

/// One volume, whole.
struct CastContent {
  std::span<const Density> density;
  std::span<const Label> labels;  ///< empty, or one per voxel
  TransferFunction transfer;
};

/// A volume as the ray caster keeps it; whole once, then bricks only.
class CastVolume {
 public:
  /// Throws VisualizerError for a volume that the kernels cannot address.
  CastVolume(const VolumeView& volume, const CastContent& content, CastMode mode,
             GradientFilter filter);

  /// Takes bricks `changed` of `density` (the whole volume) and the cells they touch.
  void update_bricks(std::span<const Density> density, const ChangedBricks& changed);

  /// See `Caster::set_transform`.
  void set_transform(const glm::dmat4& world_from_voxel) { world_from_voxel_ = world_from_voxel; }

  /// Other colours and opacities.
  void set_materials(const Palette& materials);

  [[nodiscard]] const GradientRows& gradient() const noexcept { return gradient_; }
  [[nodiscard]] double edge_mm() const { return shortest_edge_mm(world_from_voxel_); }
  /// A box around all that can be seen of it; nothing can if there is none.
  [[nodiscard]] std::optional<BoxCorners> body() const;
  /// For a part of a picture of `width` x `height`; good until the next call of anything.
  [[nodiscard]] CastVolumeJob job(const View& view, std::int32_t width, std::int32_t height,
                                  const PixelRect& part);

 private:
  /// Whether the near plane of `view` may pass an active cell within the picture.
  [[nodiscard]] bool near_plane_is_inside(const View& view,
                                          const glm::dmat4& world_from_cell) const;
  /// What cells in a box are, and what that makes of their neighbours.
  void take_cells(const VoxelBox& cells);

  BrickGrid bricks_;
  glm::dmat4 world_from_voxel_;
  TransferFunction transfer_;  ///< extinction in place of opacity
  float settled_ = 1.0F;       ///< `CastVolumeJob::settled`
  float iso_;                  ///< 0..1
  PairedRows<Density, std::uint32_t> density_;
  std::optional<PairedRows<Label, std::uint16_t>> labels_;
  GradientRows gradient_;
  Macrocells cells_;
  std::vector<std::uint8_t> active_;  ///< of the cells, and room to load four at the last
  std::vector<MacrocellDepthRange::Cell> outer_cells_;  ///< active, with a face to an empty one
  VoxelBox body_;                                       ///< around them
  MacrocellDepthRange blocks_;
};

}  // namespace kerf
