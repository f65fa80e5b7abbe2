// SPDX-License-Identifier: Apache-2.0
#include "visualizer/stale_volume.hpp"

#include <algorithm>
#include <array>

#include "visualizer/feelers.hpp"
#include "visualizer/screen_bounds.hpp"

namespace kerf {

namespace {

constexpr std::size_t kMostBoxes = 256;  // some cuts between two pictures; more count as one

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
    const glm::dvec4 voxel((c & 1) != 0 ? box.hi.x - 1 : box.lo.x,
                           (c & 2) != 0 ? box.hi.y - 1 : box.lo.y,
                           (c & 4) != 0 ? box.hi.z - 1 : box.lo.z, 1.0);
    corners[c] = glm::dvec3(volume.world_from_voxel * voxel);
    nearest_mm = std::min(nearest_mm, -(view.eye_from_world * glm::dvec4(corners[c], 1.0)).z);
  }
  constexpr double kSlack = 1e-4;  // of the distance: the depth of a picture has 24 bits
  const double from_mm = std::max(nearest_mm * (1.0 - kSlack), view.near_mm);
  return {screen_bounds(corners, view, size),
          static_cast<float>(window_depth(from_mm, view.near_mm, view.far_mm))};
}

/// The part of a picture's depth that is asked for.
class KeptDepth {
 public:
  KeptDepth(const RenderTarget& of, const PixelRect& part)
      : part_(part), window_(of.read_depth(part)) {}

  [[nodiscard]] const float* row(int y) const {
    return window_.data() + static_cast<std::ptrdiff_t>(y - part_.y0) * (part_.x1 - part_.x0) -
           part_.x0;
  }
  [[nodiscard]] float farthest(const PixelRect& pixels) const {
    float farthest = 0.0F;
    for (int y = pixels.y0; y < pixels.y1; ++y) {
      farthest = std::max(farthest, *std::max_element(row(y) + pixels.x0, row(y) + pixels.x1));
    }
    return farthest;
  }

 private:
  PixelRect part_;
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
  // Whole tiles are looked at.
  const PixelRect read = tiles.tiles_of(all.united(felt));
  if (read.empty()) return;
  const KeptDepth depth(
      kept, tiles.pixels_of(read.x0, read.y0).united(tiles.pixels_of(read.x1 - 1, read.y1 - 1)));
  for (const Covered& box : covered) {
    // What is in sight before the box hides it.
    mark_where(tiles, box.pixels,
               [&](const PixelRect& tile) { return depth.farthest(tile) >= box.from; });
  }
  if (felt.empty()) return;
  const Feelers feelers(volume, density, differs_, view, kept.size());
  mark_where(tiles, felt, [&](const PixelRect& tile) {
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) {
        const float at = depth.row(y)[x];
        if (at < 1.0F && feelers.may_reach(x, y, at)) return true;
      }
    }
    return false;
  });
}

}  // namespace kerf
