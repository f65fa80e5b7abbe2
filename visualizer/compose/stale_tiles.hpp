// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "visualizer/gl/target.hpp"
#include "visualizer/view/pixel_rect.hpp"

namespace kerf {

/// Which tiles of a picture must be drawn again. Tiles of 4x4 pixels, in which the
/// ray caster and a software GL shade.
class StaleTiles {
 public:
  static constexpr int kEdge = 4;

  explicit StaleTiles(PictureSize size);

  /// The tiles, counted in tiles, that `pixels` touch; clipped to the picture.
  [[nodiscard]] PixelRect tiles_of(const PixelRect& pixels) const;
  /// The pixels of some tiles that exist.
  [[nodiscard]] PixelRect pixels_of(const PixelRect& tiles) const;

  /// All that `pixels` touch.
  void mark(const PixelRect& pixels);
  void mark(int x, int y) { marked_[at(x, y)] = 1; }
  /// All that are marked in `other`, of the same picture.
  void mark(const StaleTiles& other);
  void clear();
  [[nodiscard]] bool marked(int x, int y) const { return marked_[at(x, y)] != 0; }

  /// Rectangles of pixels, apart from one another, that cover the marked tiles, and of others a few
  /// where that saves rectangles: each costs a draw call.
  [[nodiscard]] std::vector<PixelRect> rects() const;

 private:
  [[nodiscard]] std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y * across_ + x);
  }

  PictureSize size_;
  int across_, along_;
  std::vector<std::uint8_t> marked_;
};

}  // namespace kerf
