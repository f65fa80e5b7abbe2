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
    const PixelRect in = tiles.tiles_of(part);
    pixels_ = tiles.pixels_of(in.x0, in.y0).united(tiles.pixels_of(in.x1 - 1, in.y1 - 1));
    window_ = of.read_depth(pixels_);
  }

  [[nodiscard]] const float* row(int y) const {
    return window_.data() +
           static_cast<std::ptrdiff_t>(y - pixels_.y0) * (pixels_.x1 - pixels_.x0) - pixels_.x0;
  }
  struct Range {
    float nearest, farthest;
  };
  [[nodiscard]] Range range(const PixelRect& pixels) const {
    Range range{1.0F, 0.0F};
    for (int y = pixels.y0; y < pixels.y1; ++y) {
      for (int x = pixels.x0; x < pixels.x1; ++x) {
        range.nearest = std::min(range.nearest, row(y)[x]);
        range.farthest = std::max(range.farthest, row(y)[x]);
      }
    }
    return range;
  }

 private:
  PixelRect pixels_;
  std::vector<float> window_;
};

/// Calls `look` for each tile of `pixels` that is not marked, and marks it where that says so.
template <class Look>
void mark_where(StaleTiles& tiles, const PixelRect& pixels, const Look& look) {
  const PixelRect within = tiles.tiles_of(pixels);
  for (int y = within.y0; y < within.y1; ++y) {
    for (int x = within.x0; x < within.x1; ++x) {
      if (!tiles.marked(x, y) && look(tiles.pixels_of(x, y))) tiles.mark(x, y);
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
  const KeptDepth depth(kept, tiles, all);
  for (const Covered& box : covered) {
    // What is in sight before the box hides it.
    mark_where(tiles, box.pixels,
               [&](const PixelRect& tile) { return depth.range(tile).farthest >= box.from; });
  }
  if (felt.empty()) return;
  const Feelers feelers(volume, density, differs_, view, kept.size());
  const auto is_near = [&](const PixelRect& pixels) {
    const auto [nearest, farthest] = depth.range(pixels);
    return feelers.may_reach(pixels, nearest, farthest);
  };
  const auto is_felt = [&](const PixelRect& tile) {
    if (!is_near(tile)) return false;
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) {
        const float at = depth.row(y)[x];
        if (at < 1.0F && feelers.may_reach(x, y, at)) return true;
      }
    }
    return false;
  };
  // Most of it is far from the change: many tiles at once.
  constexpr int kManyTiles = 4 * StaleTiles::kEdge;
  const PixelRect whole = felt.clipped({0, 0, kept.size().width, kept.size().height});
  for (int y = whole.y0 / kManyTiles * kManyTiles; y < whole.y1; y += kManyTiles) {
    for (int x = whole.x0 / kManyTiles * kManyTiles; x < whole.x1; x += kManyTiles) {
      const PixelRect some = PixelRect{x, y, x + kManyTiles, y + kManyTiles}.clipped(whole);
      if (is_near(some)) mark_where(tiles, some, is_felt);
    }
  }
}

}  // namespace kerf
