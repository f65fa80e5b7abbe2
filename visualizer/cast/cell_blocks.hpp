// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "visualizer/cast/cast_job.hpp"
#include "visualizer/view/camera.hpp"

namespace kerf {

/// Where the rays of each block of pixels can meet the active cells of a volume: the picture of the
/// cells, coarse and on the safe side. Rays of a block without cells cost nothing, the others begin
/// and end near what they may see; what lies between is told by the cells themselves.
class CellBlocks {
 public:
  using Cell = std::array<std::uint16_t, 3>;

  /// For a part of a picture of `width` x `height` seen through `view`. `cells` are the active ones
  /// that have a face to an empty one or to the outside: a ray enters and leaves what is active
  /// through them. Where rays may `begin_inside`, all begin at the near plane.
  void draw(std::span<const Cell> cells, bool begin_inside, const glm::dmat4& world_from_cell,
            const View& view, std::int32_t width, std::int32_t height, const PixelRect& part);

  /// `CastVolumeJob::blocks`; those beside the part are left over from other ones.
  [[nodiscard]] const CastBlock* data() const noexcept { return blocks_.data(); }

 private:
  void cover(const glm::dvec2& low, const glm::dvec2& high, const CastBlock& range);

  std::int32_t across_ = 0;
  PixelRect drawn_;  ///< blocks of the part
  std::vector<CastBlock> blocks_;
};

}  // namespace kerf
