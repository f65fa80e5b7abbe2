// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <span>
#include <vector>

namespace kerf {

/// Width and height of a picture in pixels, each 1..kMaxSide.
struct PictureSize {
  static constexpr int kMaxSide = 8192;  ///< a 32-bit colour picture of 256 MiB
  int width = 512;
  int height = 512;
  friend constexpr bool operator==(PictureSize, PictureSize) noexcept = default;
};

/// A part of a picture in pixels, half-open, first row at the bottom as GL counts; empty if any
/// extent is not positive.
struct PixelRect {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  [[nodiscard]] constexpr bool empty() const noexcept { return x1 <= x0 || y1 <= y0; }
  [[nodiscard]] constexpr int area() const noexcept { return empty() ? 0 : (x1 - x0) * (y1 - y0); }
  [[nodiscard]] constexpr PixelRect grown(int by) const noexcept {
    return empty() ? PixelRect{} : PixelRect{x0 - by, y0 - by, x1 + by, y1 + by};
  }
  [[nodiscard]] constexpr PixelRect clipped(const PixelRect& to) const noexcept {
    return {std::max(x0, to.x0), std::max(y0, to.y0), std::min(x1, to.x1), std::min(y1, to.y1)};
  }
  /// Smallest one that holds both; an empty one adds nothing.
  [[nodiscard]] constexpr PixelRect united(const PixelRect& other) const noexcept {
    if (empty()) return other;
    if (other.empty()) return *this;
    return {std::min(x0, other.x0), std::min(y0, other.y0), std::max(x1, other.x1),
            std::max(y1, other.y1)};
  }
  friend constexpr bool operator==(const PixelRect&, const PixelRect&) noexcept = default;
};

/// What of `rects` lies in `bounds`; none of it is empty.
[[nodiscard]] inline std::vector<PixelRect> clipped(std::span<const PixelRect> rects,
                                                    const PixelRect& bounds) {
  std::vector<PixelRect> inside;
  for (const PixelRect& rect : rects) {
    if (const PixelRect both = rect.clipped(bounds); !both.empty()) inside.push_back(both);
  }
  return inside;
}
/// The smallest rectangle that holds all of `rects`.
[[nodiscard]] inline PixelRect united(std::span<const PixelRect> rects) noexcept {
  PixelRect all;
  for (const PixelRect& rect : rects) all = all.united(rect);
  return all;
}

/// Where the mouse is, in pixels of the picture from its upper left corner, and its left button.
struct Pointer {
  double x = -1.0, y = -1.0;  ///< outside at first
  bool down = false;
  double wheel = 0.0;  ///< steps
  friend bool operator==(const Pointer&, const Pointer&) noexcept = default;
};

}  // namespace kerf
