// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "shared/segment/layout.hpp"

namespace kerf {

/// Commanded force and depth of the tool over the last five seconds of the machine's clock. One
/// point per picture: the newest tick at that time.
class ForcePlot {
 public:
  static constexpr double kSpanS = 5.0;

  struct Point {
    std::uint64_t time_ns = 0;  ///< CLOCK_MONOTONIC
    float force_n = 0.0F;
    float penetration_mm = 0.0F;
    friend bool operator==(const Point&, const Point&) noexcept = default;
  };

  /// A record that is not newer than the last one changes nothing.
  void add(const TickRecord& record);

  /// Oldest first; all within the span before the last one.
  [[nodiscard]] const std::vector<Point>& points() const noexcept { return points_; }

 private:
  std::vector<Point> points_;
};

}  // namespace kerf
