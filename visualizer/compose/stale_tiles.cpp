// SPDX-License-Identifier: Apache-2.0
#include "visualizer/compose/stale_tiles.hpp"

#include <algorithm>
#include <functional>

namespace kerf {

StaleTiles::StaleTiles(PictureSize size)
    : size_(size),
      across_((size.width + kEdge - 1) / kEdge),
      along_((size.height + kEdge - 1) / kEdge),
      marked_(static_cast<std::size_t>(across_) * static_cast<std::size_t>(along_)) {}

PixelRect StaleTiles::tiles_of(const PixelRect& pixels) const {
  const PixelRect in = pixels.clipped({0, 0, size_.width, size_.height});
  if (in.empty()) return {};
  return {in.x0 / kEdge, in.y0 / kEdge, (in.x1 - 1) / kEdge + 1, (in.y1 - 1) / kEdge + 1};
}

PixelRect StaleTiles::pixels_of(const PixelRect& tiles) const {
  return PixelRect{tiles.x0 * kEdge, tiles.y0 * kEdge, tiles.x1 * kEdge, tiles.y1 * kEdge}.clipped(
      {0, 0, size_.width, size_.height});
}

void StaleTiles::mark(const PixelRect& pixels) {
  const PixelRect tiles = tiles_of(pixels);
  for (int y = tiles.y0; y < tiles.y1; ++y) {
    for (int x = tiles.x0; x < tiles.x1; ++x) mark(x, y);
  }
}

void StaleTiles::mark(const StaleTiles& other) {
  std::transform(marked_.begin(), marked_.end(), other.marked_.begin(), marked_.begin(),
                 std::bit_or<>());
}

void StaleTiles::clear() {
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

std::vector<PixelRect> StaleTiles::rects() const {
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

}  // namespace kerf
