// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "record/tick_log.hpp"
#include "shared/text/json.hpp"

// The forces of a recording as a plot.

namespace kerf {

/// Draws the recording in `folder` as an SVG of three panels over time: force magnitudes in N,
/// penetration in mm with removed volume in mm^3, and the work of the hand in mJ with its sources.
/// At most 4000 points per curve, every peak kept. With two arms `arm` is drawn, and of the first
/// also the commanded force and the penetration of the second.
///
/// The file appears whole or not at all. Throws `RecordError`, `ReportError` or `FileError`.
void plot_forces(const std::filesystem::path& folder, const std::filesystem::path& svg,
                 TickRange range = {}, std::size_t arm = 0);

/// A curve of at most `max_points` points that keeps every peak: the smallest and the largest of
/// each stretch of samples, in their order. If all samples fit, all stay.
class Envelope {
 public:
  struct Point {
    double x = 0, y = 0;
    friend bool operator==(const Point&, const Point&) noexcept = default;
  };

  /// `samples`: number of the `add` calls to come.
  Envelope(std::uint64_t samples, std::size_t max_points)
      : stretch_(samples <= max_points ? 1 : (samples + max_points / 2 - 1) / (max_points / 2)) {}

  void add(double x, double y) {
    if (seen_ == 0) low_ = high_ = {x, y};
    if (y < low_.y) low_ = {x, y};
    if (y > high_.y) high_ = {x, y};
    if (++seen_ == stretch_) close_stretch();
  }

  /// After the last `add`.
  [[nodiscard]] const std::vector<Point>& points() {
    close_stretch();
    return points_;
  }

 private:
  void close_stretch() {
    if (seen_ == 0) return;
    const bool low_first = low_.x <= high_.x;
    points_.push_back(low_first ? low_ : high_);
    if (!(low_ == high_)) points_.push_back(low_first ? high_ : low_);
    seen_ = 0;
  }

  std::uint64_t stretch_;
  std::uint64_t seen_ = 0;
  Point low_, high_;
  std::vector<Point> points_;
};

/// `{name, s, values}` of a finished curve over seconds.
[[nodiscard]] Json json_of(std::string_view name, Envelope& envelope);

}  // namespace kerf
