// SPDX-License-Identifier: Apache-2.0
#include "visualizer/view/silhouette.hpp"

#include <algorithm>
#include <limits>

namespace kerf {

namespace {

constexpr int kMeshRows = 24;  // as many as a small picture has pixels

/// Adds a body of revolution up to `end_mm`.
void add_profile(const std::vector<std::array<double, 2>>& profile, double end_mm,
                 Silhouette& rows) {
  for (std::size_t i = 0; i < profile.size(); ++i) {
    auto [y, radius] = profile[i];
    if (y > end_mm) {
      if (i == 0) return;
      const auto [before, from] = profile[i - 1];
      radius = from + (radius - from) * (end_mm - before) / (y - before);
      y = end_mm;
    }
    rows.push_back({y, -radius, radius});
    if (y >= end_mm) return;
  }
}

/// Where the edges of a mesh cross equal steps of height.
Silhouette rows_of(const Facets& facets) {
  double low = std::numeric_limits<double>::max(), high = -low;
  for (const auto& point : facets.points_mm) {
    low = std::min(low, point[1]);
    high = std::max(high, point[1]);
  }
  Silhouette rows;
  if (!(high > low)) return rows;
  for (int i = 0; i <= kMeshRows; ++i) {
    const double y = low + (high - low) * i / kMeshRows;
    std::array<double, 3> row{y, std::numeric_limits<double>::max(),
                              -std::numeric_limits<double>::max()};
    for (const auto& triangle : facets.triangles) {
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const auto& a = facets.points_mm[triangle[corner]];
        const auto& b = facets.points_mm[triangle[(corner + 1) % 3]];
        if (std::min(a[1], b[1]) > y || std::max(a[1], b[1]) < y) continue;
        const double share = b[1] != a[1] ? (y - a[1]) / (b[1] - a[1]) : 0.0;
        const double x = a[0] + (b[0] - a[0]) * share;
        row = {y, std::min(row[1], x), std::max(row[2], x)};
      }
    }
    if (row[1] <= row[2]) rows.push_back(row);
  }
  return rows;
}

}  // namespace

Silhouette silhouette_of(const ToolView& tool) {
  Silhouette rows;
  if (tool.profile_mm.empty()) {
    rows = rows_of(tool.facets);
  } else {
    add_profile(tool.profile_mm, std::numeric_limits<double>::max(), rows);
  }
  if (rows.empty() || !(rows.back()[0] > rows.front()[0])) return {};
  const double head_end = rows.back()[0];
  Silhouette shaft;
  add_profile(tool.shaft_mm, head_end + (head_end - rows.front()[0]), shaft);
  for (const auto& [y, left, right] : shaft) {
    if (y <= head_end) continue;
    if (rows.back()[0] == head_end) rows.push_back({head_end, left, right});
    rows.push_back({y, left, right});
  }
  return rows;
}

}  // namespace kerf
