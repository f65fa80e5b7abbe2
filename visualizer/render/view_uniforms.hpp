// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "visualizer/gl/program.hpp"
#include "visualizer/view/camera.hpp"

namespace kerf {

/// What ray.frag and the light need to know of a view: u_half_size_at_1mm, u_middle_at_1mm,
/// u_near_mm, u_far_mm, u_shown_eye, u_up_eye.
void set_view(const GlProgram& program, const View& view);

}  // namespace kerf
