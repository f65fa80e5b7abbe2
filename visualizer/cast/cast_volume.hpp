// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "visualizer/cast/cast_job.hpp"
#include "visualizer/cast/cell_distance.hpp"
#include "visualizer/cast/paired_rows.hpp"
#include "visualizer/macrocells.hpp"
#include "visualizer/scene_view.hpp"

namespace kerf {

/// A volume as the ray caster keeps it; whole once, then bricks only.
class CastVolume {
 public:
  /// Samples below density `least` show nothing. Throws VisualizerError for a volume that the
  /// kernels cannot address.
  CastVolume(const VolumeView& volume, std::span<const Density> density,
             std::span<const Label> labels, Density least);

  /// Takes bricks `changed` of `density` (the whole volume) and the cells they touch.
  void update_bricks(std::span<const Density> density, std::span<const std::uint32_t> changed);

  [[nodiscard]] CastVolumeJob job(const glm::dmat4& eye_from_world) const;

 private:
  BrickGrid bricks_;
  glm::dmat4 world_from_voxel_;
  float iso_;  ///< 0..1
  PairedRows<Density, std::uint32_t> density_;
  std::optional<PairedRows<Label, std::uint16_t>> labels_;
  Macrocells cells_;
  CellDistance distance_;
};

}  // namespace kerf
