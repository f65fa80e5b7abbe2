// SPDX-License-Identifier: Apache-2.0
#include "visualizer/render/slice_polygons.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace kerf {

std::vector<glm::dvec2> cut_box(const BoxCorners& eye_corners, double eye_mm) {
  std::vector<glm::dvec2> vertices;
  for (std::size_t from = 0; from < eye_corners.size(); ++from) {
    for (const std::size_t axis : {1U, 2U, 4U}) {
      if ((from & axis) != 0) continue;  // each of the twelve edges once
      const glm::dvec3& a = eye_corners[from];
      const glm::dvec3& b = eye_corners[from | axis];
      const double before = -a.z - eye_mm;
      const double behind = -b.z - eye_mm;
      if ((before < 0.0) == (behind < 0.0)) continue;
      vertices.emplace_back(glm::mix(a, b, before / (before - behind)));
    }
  }
  const glm::dvec2 middle = std::accumulate(vertices.begin(), vertices.end(), glm::dvec2(0.0)) /
                            static_cast<double>(std::max<std::size_t>(vertices.size(), 1));
  const auto angle = [&](glm::dvec2 v) { return std::atan2(v.y - middle.y, v.x - middle.x); };
  std::sort(vertices.begin(), vertices.end(),
            [&](glm::dvec2 a, glm::dvec2 b) { return angle(a) < angle(b); });
  return vertices;
}

}  // namespace kerf
