// SPDX-License-Identifier: Apache-2.0
#include "visualizer/compose/stale_triangles.hpp"

#include <algorithm>
#include <vector>

#include <glm/gtc/matrix_transform.hpp>

namespace kerf {

namespace {

/// Where a triangle may show.
struct Shown {
  PixelRect pixels;
  float nearest;  ///< window depth
};

constexpr float kSlackPx = 0.0625F;  // a GPU snaps corners to 1/16 pixel, or finer
constexpr float kSlackDepth = 1e-5F;

/// (x, y, z, w) at once; both compilers have it for every processor.
using Four = float __attribute__((vector_size(4 * sizeof(float))));

Four smaller(Four a, Four b) {
  return a < b ? a : b;
}
Four larger(Four a, Four b) {
  return a < b ? b : a;
}

/// From fine places to pixels and window depth, times w.
class WindowFromFine {
 public:
  WindowFromFine(const glm::dmat4& clip_from_voxel, const PixelRect& all) : all_(all) {
    const glm::dvec3 half(0.5 * all.x1, 0.5 * all.y1, 0.5);
    const glm::dmat4 window_from_clip =
        glm::translate(glm::dmat4(1.0), half) * glm::scale(glm::dmat4(1.0), half);
    const glm::mat4 matrix(window_from_clip * clip_from_voxel *
                           glm::scale(glm::dmat4(1.0), glm::dvec3(1.0 / kFinePerVoxel)));
    for (int i = 0; i < 4; ++i) {
      column_[i] = Four{matrix[i].x, matrix[i].y, matrix[i].z, matrix[i].w};
    }
  }

  [[nodiscard]] Shown shown(const FineTriangle& triangle) const {
    // Far beyond the border it does not matter how far.
    const Four least{-1.0F, -1.0F, 0.0F, 0.0F};
    const Four most{static_cast<float>(all_.x1 + 1), static_cast<float>(all_.y1 + 1), 2.0F, 2.0F};
    Four low = most, high = least;
    int before_near = 0;
    for (const FinePoint& corner : triangle) {
      const Four at = static_cast<float>(corner.x) * column_[0] +
                      static_cast<float>(corner.y) * column_[1] +
                      static_cast<float>(corner.z) * column_[2] + column_[3];
      if (at[2] < 0.0F) {
        ++before_near;
        continue;
      }
      const Four window = smaller(larger(at / at[3], least), most);
      low = smaller(low, window);
      high = larger(high, window);
    }
    if (before_near == 3) return {{}, 1.0F};
    if (before_near > 0) return {all_, 0.0F};  // rarely: the surface touches the eye
    // Centres are at 0.5, 1.5, ...
    const auto below = [](float at) { return static_cast<int>(at + 2.0F) - 2; };  // at > -2
    const PixelRect pixels{below(low[0] + 0.5F - kSlackPx), below(low[1] + 0.5F - kSlackPx),
                           below(high[0] + 0.5F + kSlackPx), below(high[1] + 0.5F + kSlackPx)};
    // Seen on edge, what is rounded moves its depth by as much as it is deep.
    return {pixels.clipped(all_), low[2] - (high[2] - low[2]) - kSlackDepth};
  }

 private:
  PixelRect all_;
  Four column_[4];
};

}  // namespace

void mark_triangles(StaleTiles& tiles, std::span<const FineTriangle> triangles,
                    const glm::dmat4& clip_from_voxel, const RenderTarget& kept) {
  const WindowFromFine window_from_fine(clip_from_voxel, kept.all());
  std::vector<Shown> shown;
  shown.reserve(triangles.size());
  PixelRect window;
  for (const FineTriangle& triangle : triangles) {
    shown.push_back(window_from_fine.shown(triangle));
    window = window.united(shown.back().pixels);
  }
  if (window.empty()) return;
  const std::vector<float> depth = kept.read_depth(window);
  const auto hidden = [&](const Shown& one, const PixelRect& pixels) {
    for (int y = pixels.y0; y < pixels.y1; ++y) {
      const auto first =
          depth.begin() + (y - window.y0) * (window.x1 - window.x0) + pixels.x0 - window.x0;
      if (std::any_of(first, first + (pixels.x1 - pixels.x0),
                      [&](float kept_depth) { return one.nearest <= kept_depth; })) {
        return false;
      }
    }
    return true;
  };
  for (const Shown& one : shown) {
    const PixelRect in = tiles.tiles_of(one.pixels);
    for (int y = in.y0; y < in.y1; ++y) {
      for (int x = in.x0; x < in.x1; ++x) {
        if (tiles.marked(x, y)) continue;
        const PixelRect pixels = tiles.pixels_of({x, y, x + 1, y + 1}).clipped(one.pixels);
        if (!hidden(one, pixels)) tiles.mark(x, y);
      }
    }
  }
}

}  // namespace kerf
