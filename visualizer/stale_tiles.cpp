// SPDX-License-Identifier: Apache-2.0
#include "visualizer/stale_tiles.hpp"

#include <algorithm>

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

PixelRect StaleTiles::pixels_of(int x, int y) const {
  return PixelRect{x * kEdge, y * kEdge, (x + 1) * kEdge, (y + 1) * kEdge}.clipped(
      {0, 0, size_.width, size_.height});
}

void StaleTiles::mark(const PixelRect& pixels) {
  const PixelRect tiles = tiles_of(pixels);
  for (int y = tiles.y0; y < tiles.y1; ++y) {
    for (int x = tiles.x0; x < tiles.x1; ++x) mark(x, y);
  }
}

std::vector<PixelRect> StaleTiles::rects() const {
  std::vector<PixelRect> done;
  std::vector<PixelRect> open;  // runs of the row below, in tiles, that may go on
  for (int y = 0; y <= along_; ++y) {
    std::vector<PixelRect> runs;
    for (int x = 0; y < along_ && x < across_; ++x) {
      if (!marked(x, y)) continue;
      const int from = x;
      while (x < across_ && marked(x, y)) ++x;
      runs.push_back({from, y, x, y + 1});
    }
    for (const PixelRect& below : open) {
      const auto same = std::find_if(runs.begin(), runs.end(), [&](const PixelRect& run) {
        return run.x0 == below.x0 && run.x1 == below.x1;
      });
      if (same != runs.end()) {
        same->y0 = below.y0;
      } else {
        done.push_back(below);
      }
    }
    open = std::move(runs);
  }
  for (PixelRect& rect : done) {
    rect = PixelRect{rect.x0 * kEdge, rect.y0 * kEdge, rect.x1 * kEdge, rect.y1 * kEdge}.clipped(
        {0, 0, size_.width, size_.height});
  }
  return done;
}

}  // namespace kerf
