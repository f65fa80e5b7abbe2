// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "visualizer/cast/cast_job.hpp"
#include "visualizer/cast/cell_blocks.hpp"
#include "visualizer/cast/gradient_rows.hpp"
#include "visualizer/cast/macrocells.hpp"
#include "visualizer/cast/paired_rows.hpp"
#include "visualizer/view/camera.hpp"
#include "visualizer/view/scene_view.hpp"
#include "visualizer/view/transfer_function.hpp"

namespace kerf {

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
  TransferFunction matter;
};

/// A volume as the ray caster keeps it; whole once, then bricks only.
class CastVolume {
 public:
  /// Throws VisualizerError for a volume that the kernels cannot address.
  CastVolume(const VolumeView& volume, const CastContent& content, CastMode mode);

  /// Takes bricks `changed` of `density` (the whole volume) and the cells they touch.
  void update_bricks(std::span<const Density> density, std::span<const std::uint32_t> changed);

  /// See `Caster::place`.
  void place(const glm::dmat4& world_from_voxel) { world_from_voxel_ = world_from_voxel; }

  /// Other colours and opacities.
  void set_materials(const Palette& materials);

  [[nodiscard]] double edge_mm() const { return shortest_edge_mm(world_from_voxel_); }
  /// A box around all that can be seen of it; nothing can where there is none.
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
  TransferFunction matter_;  ///< extinction in place of opacity
  float settled_ = 1.0F;     ///< `CastVolumeJob::settled`
  float iso_;                ///< 0..1
  PairedRows<Density, std::uint32_t> density_;
  std::optional<PairedRows<Label, std::uint16_t>> labels_;
  std::optional<GradientRows> gradient_;  ///< blend only
  Macrocells cells_;
  std::vector<std::uint8_t> active_;           ///< of the cells, and room to load four at the last
  std::vector<CellBlocks::Cell> outer_cells_;  ///< active, with a face to an empty one
  VoxelBox body_;                              ///< around them
  CellBlocks blocks_;
};

}  // namespace kerf
