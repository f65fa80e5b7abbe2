// SPDX-License-Identifier: Apache-2.0
#include "visualizer/stale_volume.hpp"

#include <algorithm>
#include <array>

#include "visualizer/feelers.hpp"
#include "visualizer/screen_bounds.hpp"

namespace kerf {

namespace {

constexpr std::size_t kMostBoxes = 1024;  // some cuts between two pictures; more count as one

/// A box as the picture sees it.
struct Covered {
  PixelRect pixels;
  float from;  ///< window depth of its nearest corner
};

Covered covered_by(const VoxelBox& box, const VolumeView& volume, const View& view,
                   PictureSize size) {
  std::array<glm::dvec3, 8> corners;
  double nearest_mm = view.far_mm;
  for (std::size_t c = 0; c < corners.size(); ++c) {
    constexpr double kSlackVox = 0.05;  // for what a depth of 24 bits and a shader round
    const auto end = [&](std::size_t axis, std::int32_t lo, std::int32_t hi) {
      return (c >> axis & 1) != 0 ? hi - 1 + kSlackVox : lo - kSlackVox;
    };
    const glm::dvec4 voxel(end(0, box.lo.x, box.hi.x), end(1, box.lo.y, box.hi.y),
                           end(2, box.lo.z, box.hi.z), 1.0);
    corners[c] = glm::dvec3(volume.world_from_voxel * voxel);
    nearest_mm = std::min(nearest_mm, -(view.eye_from_world * glm::dvec4(corners[c], 1.0)).z);
  }
  constexpr double kSlack = 1e-4;  // of the distance
  const double from_mm = std::max(nearest_mm * (1.0 - kSlack), view.near_mm);
  return {screen_bounds(corners, view, size),
          static_cast<float>(window_depth(from_mm, view.near_mm, view.far_mm))};
}

/// The depth of the tiles that touch a part of a picture.
class KeptDepth {
 public:
  KeptDepth(const RenderTarget& of, const StaleTiles& tiles, const PixelRect& part) {
    within_ = tiles.tiles_of(part);
    pixels_ = tiles.pixels_of(within_.x0, within_.y0)
                  .united(tiles.pixels_of(within_.x1 - 1, within_.y1 - 1));
    window_ = of.read_depth(pixels_);
    ranges_.resize(static_cast<std::size_t>(within_.area()));
  }

  [[nodiscard]] const float* row(int y) const {
    return window_.data() +
           static_cast<std::ptrdiff_t>(y - pixels_.y0) * (pixels_.x1 - pixels_.x0) - pixels_.x0;
  }
  struct Range {
    float nearest = 1.0F, farthest = 0.0F;
    void add(const Range& other) {
      nearest = std::min(nearest, other.nearest);
      farthest = std::max(farthest, other.farthest);
    }
  };
  /// Of all pixels of these tiles.
  [[nodiscard]] Range range(const PixelRect& tiles) {
    Range range;
    for (int y = tiles.y0; y < tiles.y1; ++y) {
      for (int x = tiles.x0; x < tiles.x1; ++x) range.add(tile_range(x, y));
    }
    return range;
  }
  /// Of a tile; worked out when it is asked for first.
  [[nodiscard]] const Range& tile_range(int x, int y) {
    Range& range = ranges_[static_cast<std::size_t>((y - within_.y0) * (within_.x1 - within_.x0) +
                                                    x - within_.x0)];
    if (range.nearest > range.farthest) {
      constexpr int kEdge = StaleTiles::kEdge;
      for (int py = y * kEdge; py < std::min((y + 1) * kEdge, pixels_.y1); ++py) {
        for (int px = x * kEdge; px < std::min((x + 1) * kEdge, pixels_.x1); ++px) {
          range.add({row(py)[px], row(py)[px]});
        }
      }
    }
    return range;
  }

 private:
  PixelRect within_;  ///< tiles
  PixelRect pixels_;
  std::vector<float> window_;
  std::vector<Range> ranges_;  ///< by tile; upside down where nobody has asked
};

/// Calls `look` for each of these tiles that is not marked, and marks it where that says so.
template <class Look>
void mark_where(StaleTiles& tiles, const PixelRect& within, const Look& look) {
  for (int y = within.y0; y < within.y1; ++y) {
    for (int x = within.x0; x < within.x1; ++x) {
      if (!tiles.marked(x, y) && look(x, y)) tiles.mark(x, y);
    }
  }
}

VoxelBox united(const std::vector<VoxelBox>& boxes) {
  VoxelBox all;
  for (const VoxelBox& box : boxes) all = all.united(box);
  return all;
}

void add_to(std::vector<VoxelBox>& boxes, std::span<const VoxelBox> more) {
  boxes.insert(boxes.end(), more.begin(), more.end());
  if (boxes.size() > kMostBoxes) boxes = {united(boxes)};
}

}  // namespace

void StaleVolume::add(const Renderer& renderer, std::size_t index,
                      std::span<const VoxelBox> differs) {
  add_to(differs_, differs);
  add_to(looks_, renderer.looks_different(index, differs));
}

void StaleVolume::clear() {
  differs_.clear();
  looks_.clear();
}

void StaleVolume::mark(StaleTiles& tiles, const Renderer& renderer, const VolumeView& volume,
                       std::span<const Density> density, const View& view,
                       const RenderTarget& kept) const {
  std::vector<Covered> covered;
  PixelRect all;
  for (const VoxelBox& box : looks_) {
    covered.push_back(covered_by(box, volume, view, kept.size()));
    all = all.united(covered.back().pixels);
  }
  if (renderer.translucent()) {
    for (const Covered& box : covered) tiles.mark(box.pixels);
    return;
  }
  PixelRect felt;
  if (renderer.feels_ahead() && !differs_.empty()) {
    felt = covered_by(united(differs_).grown(Feelers::kReachVox), volume, view, kept.size()).pixels;
  }
  all = all.united(felt);
  if (all.empty()) return;
  KeptDepth depth(kept, tiles, all);
  for (const Covered& box : covered) {
    // What is in sight before the box hides it.
    mark_where(tiles, tiles.tiles_of(box.pixels),
               [&](int x, int y) { return depth.tile_range(x, y).farthest >= box.from; });
  }
  if (felt.empty()) return;
  Feelers feelers(volume, density, differs_, view, kept.size());
  const auto is_felt = [&](int tile_x, int tile_y) {
    const PixelRect tile = tiles.pixels_of(tile_x, tile_y);
    const auto [nearest, farthest] = depth.tile_range(tile_x, tile_y);
    if (!feelers.may_reach(tile, nearest, farthest)) return false;
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) {
        const float at = depth.row(y)[x];
        if (at < 1.0F && feelers.may_reach(x, y, at)) return true;
      }
    }
    return false;
  };
  // Most of it is far from the change: many tiles at once.
  constexpr int kMany = 4;
  const PixelRect whole = tiles.tiles_of(felt);
  for (int y = whole.y0; y < whole.y1; y += kMany) {
    for (int x = whole.x0; x < whole.x1; x += kMany) {
      const PixelRect some = PixelRect{x, y, x + kMany, y + kMany}.clipped(whole);
      const auto [nearest, farthest] = depth.range(some);
      const PixelRect pixels =
          tiles.pixels_of(some.x0, some.y0).united(tiles.pixels_of(some.x1 - 1, some.y1 - 1));
      if (feelers.may_reach(pixels, nearest, farthest)) mark_where(tiles, some, is_felt);
    }
  }
}

}  // namespace kerf
