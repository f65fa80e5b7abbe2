// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/force_plot.hpp"

#include <algorithm>
#include <cmath>

namespace kerf {

void ForcePlot::add(const TickRecord& record) {
  if (!points_.empty() && record.start_ns <= points_.back().time_ns) return;
  const float(&force)[3] = record.commanded_force_n;
  points_.push_back(
      {record.start_ns, std::hypot(force[0], force[1], force[2]), record.penetration_mm});
  constexpr auto kSpanNs = static_cast<std::uint64_t>(kSpanS * 1e9);
  const auto first = std::find_if(points_.begin(), points_.end(), [&](const Point& point) {
    return record.start_ns - point.time_ns <= kSpanNs;
  });
  points_.erase(points_.begin(), first);
}

}  // namespace kerf
