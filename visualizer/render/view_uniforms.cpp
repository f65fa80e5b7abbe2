// SPDX-License-Identifier: Apache-2.0
#include "visualizer/render/view_uniforms.hpp"

#include <glm/gtc/matrix_inverse.hpp>

namespace kerf {

void set_view(const GlProgram& program, const View& view) {
  program.set("u_half_size_at_1mm",
              glm::vec2(view.tan_half_height * view.aspect, view.tan_half_height));
  program.set("u_middle_at_1mm", glm::vec2(view.middle_right, 0.0));
  program.set("u_near_mm", static_cast<float>(view.near_mm));
  program.set("u_far_mm", static_cast<float>(view.far_mm));
  // A plane goes to the eye as a row: dot(shown, world_from_eye * p).
  program.set("u_shown_eye", glm::vec4(view.shown * glm::affineInverse(view.eye_from_world)));
  program.set("u_up_eye", glm::vec3(view.eye_from_world * glm::dvec4(0, 1, 0, 0)));
}

}  // namespace kerf
