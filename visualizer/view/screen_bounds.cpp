// SPDX-License-Identifier: Apache-2.0
#include "visualizer/view/screen_bounds.hpp"

#include <cmath>
#include <limits>

namespace kerf {

PixelRect screen_bounds(std::span<const glm::dvec3> corners, const View& view, PictureSize size) {
  const PixelRect all{0, 0, size.width, size.height};
  constexpr double kFar = std::numeric_limits<double>::infinity();
  double x0 = kFar, y0 = kFar, x1 = -kFar, y1 = -kFar;
  for (const glm::dvec3& corner : corners) {
    const glm::dvec3 eye(view.eye_from_world * glm::dvec4(corner, 1.0));
    const double depth_mm = -eye.z;
    if (!(depth_mm > view.near_mm)) return all;
    const double up = eye.y / (depth_mm * view.tan_half_height);
    const double right =
        (eye.x / depth_mm - view.middle_right) / (view.tan_half_height * view.aspect);
    x0 = std::min(x0, right);
    x1 = std::max(x1, right);
    y0 = std::min(y0, up);
    y1 = std::max(y1, up);
  }
  const auto pixel = [](double ndc, int pixels) {
    return std::clamp((ndc + 1.0) / 2.0 * pixels, -1.0, pixels + 1.0);
  };
  constexpr int kRounding = 1;
  const PixelRect bounds{static_cast<int>(std::floor(pixel(x0, size.width))),
                         static_cast<int>(std::floor(pixel(y0, size.height))),
                         static_cast<int>(std::ceil(pixel(x1, size.width))),
                         static_cast<int>(std::ceil(pixel(y1, size.height)))};
  return bounds.grown(kRounding).clipped(all);
}

}  // namespace kerf
