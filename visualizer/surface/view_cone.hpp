// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include <glm/glm.hpp>

namespace kerf {

/// What can be seen through a rectangle of the picture between the near and the far plane, as six
/// planes; in the coordinates that `clip_from_space` starts from.
class ViewCone {
 public:
  /// `lo` and `hi`: the rectangle in normalised device coordinates; the picture is -1 to 1.
  ViewCone(const glm::dmat4& clip_from_space, glm::dvec2 lo, glm::dvec2 hi) {
    // A point is inside where w*lo <= x <= w*hi and so on (Gribb and Hartmann 2001).
    const glm::dmat4 rows = glm::transpose(clip_from_space);
    planes_ = {rows[0] - lo.x * rows[3], hi.x * rows[3] - rows[0], rows[1] - lo.y * rows[3],
               hi.y * rows[3] - rows[1], rows[3] + rows[2],        rows[3] - rows[2]};
    for (glm::dvec4& plane : planes_) plane /= glm::length(glm::dvec3(plane));
  }

  /// False where a ball is outside for certain.
  [[nodiscard]] bool may_show(const glm::dvec3& centre, double radius) const {
    for (const glm::dvec4& plane : planes_) {
      if (glm::dot(glm::dvec3(plane), centre) + plane.w < -radius) return false;
    }
    return true;
  }

 private:
  std::array<glm::dvec4, 6> planes_;
};

}  // namespace kerf
