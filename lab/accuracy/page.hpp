// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lab/accuracy/study.hpp"

/// The page of an accuracy study (docs/accuracy.md) and its picture.
namespace kerf::accuracy {

/// A label in pixels of its panel, y upward; `align` is gnuplot's word.
struct LabelPlace {
  double x, y;
  const char* align;
};

/// Finds room for labels beside points, first come, first served: to the right or left, above or
/// below, inside the panel and over nothing else.
class LabelPlaces {
 public:
  LabelPlaces(double width, double height) : width_(width), height_(height) {}

  /// A mark that no label may cover.
  void keep_mark_free(double x, double y) { keep_line_free(x, y, x, y, 5); }
  /// A line along an axis.
  void keep_line_free(double x0, double y0, double x1, double y1, double margin = 2) {
    taken_.push_back({std::min(x0, x1) - margin, std::min(y0, y1) - margin,
                      std::max(x0, x1) + margin, std::max(y0, y1) + margin});
  }

  /// Empty if there is no room.
  [[nodiscard]] std::optional<LabelPlace> place(const std::string& text, double x, double y) {
    constexpr double kLetter = 7.8, kHalfLine = 7, kAway = 9, kAbove = 14;
    const double wide = kLetter * static_cast<double>(text.size());
    for (const double up : {0.0, kAbove, -kAbove}) {
      for (const LabelPlace& at :
           {LabelPlace{x + kAway, y + up, "left"}, LabelPlace{x - kAway, y + up, "right"},
            LabelPlace{x - wide / 2, y + up, "left"}}) {
        const double start = at.align == std::string_view("right") ? at.x - wide : at.x;
        const Box box{start, at.y - kHalfLine, start + wide, at.y + kHalfLine};
        if (!free(box)) continue;
        taken_.push_back(box);
        return at;
      }
    }
    return std::nullopt;
  }

 private:
  struct Box {
    double x0, y0, x1, y1;
    [[nodiscard]] bool meets(const Box& b) const {
      return x0 < b.x1 && b.x0 < x1 && y0 < b.y1 && b.y0 < y1;
    }
  };

  [[nodiscard]] bool free(const Box& box) const {
    return box.x0 >= 0 && box.y0 >= 0 && box.x1 <= width_ && box.y1 <= height_ &&
           std::none_of(taken_.begin(), taken_.end(),
                        [&](const Box& other) { return other.meets(box); });
  }

  double width_, height_;
  std::vector<Box> taken_;
};

/// `docs/accuracy.md`: the question, the figures of one run, the conclusions. `plot` is the
/// picture's path from the page. Markdown. The sentences are fixed; every figure is of this run.
[[nodiscard]] std::string page(const std::vector<Entry>& entries, const std::string& plot);

/// A gnuplot script that draws errors against the time of a tick, both logarithmic: force and
/// direction against theory, work of closed loops, difference to double. Each choice is a point in
/// the colour of its knob; the line is the front, which no choice beats in both (by 1 % of error).
/// A label is drawn if there is room for it, those of the front first.
[[nodiscard]] std::string plot_script(const std::vector<Entry>& entries);

}  // namespace kerf::accuracy
