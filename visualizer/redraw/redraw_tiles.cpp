// SPDX-License-Identifier: Apache-2.0

#include "visualizer/redraw/redraw_tiles.hpp"

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include <glm/gtc/matrix_transform.hpp>

namespace kerf {

RedrawTiles::RedrawTiles(PictureSize size)
    : size_(size),
      across_((size.width + kEdge - 1) / kEdge),
      along_((size.height + kEdge - 1) / kEdge),
      marked_(static_cast<std::size_t>(across_) * static_cast<std::size_t>(along_)) {}

PixelRect RedrawTiles::tiles_of(const PixelRect& pixels) const {
  const PixelRect in = pixels.clipped({0, 0, size_.width, size_.height});
  if (in.empty()) return {};
  return {in.x0 / kEdge, in.y0 / kEdge, (in.x1 - 1) / kEdge + 1, (in.y1 - 1) / kEdge + 1};
}

PixelRect RedrawTiles::pixels_of(const PixelRect& tiles) const {
  return PixelRect{tiles.x0 * kEdge, tiles.y0 * kEdge, tiles.x1 * kEdge, tiles.y1 * kEdge}.clipped(
      {0, 0, size_.width, size_.height});
}

void RedrawTiles::mark(const PixelRect& pixels) {
  const PixelRect tiles = tiles_of(pixels);
  for (int y = tiles.y0; y < tiles.y1; ++y) {
    for (int x = tiles.x0; x < tiles.x1; ++x) mark(x, y);
  }
}

void RedrawTiles::mark(const RedrawTiles& other) {
  std::transform(marked_.begin(), marked_.end(), other.marked_.begin(), marked_.begin(),
                 std::bit_or<>());
}

RedrawTiles RedrawTiles::common(const RedrawTiles& other) const {
  RedrawTiles both(size_);
  std::transform(marked_.begin(), marked_.end(), other.marked_.begin(), both.marked_.begin(),
                 [](auto a, auto b) { return static_cast<std::uint8_t>(a & b); });
  return both;
}

RedrawTiles RedrawTiles::without(const RedrawTiles& other) const {
  RedrawTiles rest(size_);
  std::transform(marked_.begin(), marked_.end(), other.marked_.begin(), rest.marked_.begin(),
                 [](auto a, auto b) { return static_cast<std::uint8_t>(a & ~b); });
  return rest;
}

RedrawTiles RedrawTiles::take(double pixels) {
  RedrawTiles taken(size_);
  for (std::size_t i = 0; i < marked_.size() && pixels > 0.0; ++i) {
    if (marked_[i] == 0) continue;
    taken.marked_[i] = std::exchange(marked_[i], std::uint8_t{0});
    pixels -= kEdge * kEdge;
  }
  return taken;
}

double RedrawTiles::pixels() const {
  return static_cast<double>(std::count(marked_.begin(), marked_.end(), 1)) * kEdge * kEdge;
}

bool RedrawTiles::empty() const {
  return std::find(marked_.begin(), marked_.end(), 1) == marked_.end();
}

void RedrawTiles::clear() {
  std::fill(marked_.begin(), marked_.end(), std::uint8_t{0});
}

namespace {

constexpr int kSpareTiles = 4;  // that are drawn for nothing to save a rectangle

/// A rectangle of tiles that the next row may go on.
struct Open {
  PixelRect rect;
  bool alone;  ///< no other rectangle is in its rows: it may become wider
};

/// Whether `row`, which lies on `below`, takes it in.
bool takes_in(Open& row, const Open& below) {
  const PixelRect both = row.rect.united(below.rect);
  const bool same = row.rect.x0 == below.rect.x0 && row.rect.x1 == below.rect.x1;
  const bool near =
      row.alone && below.alone && both.area() <= row.rect.area() + below.rect.area() + kSpareTiles;
  if (!same && !near) return false;
  row = {both, row.alone && below.alone};
  return true;
}

}  // namespace

std::vector<PixelRect> RedrawTiles::rects() const {
  std::vector<PixelRect> done;
  std::vector<Open> open;
  for (int y = 0; y <= along_; ++y) {
    std::vector<Open> row;
    for (int x = 0; y < along_ && x < across_; ++x) {
      if (!marked(x, y)) continue;
      const int from = x;
      while (x < across_ && marked(x, y)) ++x;
      row.push_back({{from, y, x, y + 1}, true});
    }
    if (row.size() > 1) {
      for (Open& run : row) run.alone = false;
    }
    for (const Open& below : open) {
      const bool goes_on =
          std::any_of(row.begin(), row.end(), [&](Open& run) { return takes_in(run, below); });
      if (!goes_on) done.push_back(below.rect);
    }
    open = std::move(row);
  }
  for (PixelRect& rect : done) rect = pixels_of(rect);
  return done;
}

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

/// From fine points to pixels and window depth, times w.
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

void mark_triangles(std::span<const FineTriangle> triangles, const KeptPicture& kept,
                    RedrawTiles& tiles) {
  if (triangles.empty()) return;
  const glm::dmat4 clip_from_voxel =
      kept.view.clip_from_eye() * kept.view.eye_from_world * kept.volume.world_from_voxel;
  const WindowFromFine window_from_fine(clip_from_voxel, kept.target.all());
  std::vector<Shown> shown;
  shown.reserve(triangles.size());
  PixelRect window;
  for (const FineTriangle& triangle : triangles) {
    shown.push_back(window_from_fine.shown(triangle));
    window = window.united(shown.back().pixels);
  }
  if (window.empty()) return;
  const std::vector<float> depth = kept.target.read_depth(window);
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
