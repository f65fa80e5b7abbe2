// SPDX-License-Identifier: Apache-2.0
#include "visualizer/cast/cast_eye.hpp"

#include <glm/gtc/matrix_access.hpp>
#include <glm/gtc/matrix_inverse.hpp>

namespace kerf {

CastEye cast_eye(const View& view, std::int32_t width, std::int32_t height) {
  CastEye eye;
  eye.width = width;
  eye.height = height;
  eye.half_width_at_1mm = static_cast<float>(view.tan_half_height * view.aspect);
  eye.half_height_at_1mm = static_cast<float>(view.tan_half_height);
  eye.middle_right_at_1mm = static_cast<float>(view.middle_right);
  eye.near_mm = static_cast<float>(view.near_mm);
  eye.far_mm = static_cast<float>(view.far_mm);
  // Equation (1) as depth_far - depth_slope / t.
  const double span_mm = view.far_mm - view.near_mm;
  eye.depth_far = static_cast<float>(view.far_mm / span_mm);
  eye.depth_slope = static_cast<float>(view.far_mm * view.near_mm / span_mm);
  // A plane goes over by the transposed inverse.
  const glm::dvec4 shown = glm::transpose(glm::affineInverse(view.eye_from_world)) * view.shown;
  for (int i = 0; i < 4; ++i) eye.shown[i] = static_cast<float>(shown[i]);
  return eye;
}

void put(float (&to)[3], const glm::dvec3& from) {
  for (int i = 0; i < 3; ++i) to[i] = static_cast<float>(from[i]);
}

void put(float (&to)[3][3], const glm::dmat3& from) {
  for (int i = 0; i < 3; ++i) put(to[i], glm::row(from, i));
}

}  // namespace kerf
