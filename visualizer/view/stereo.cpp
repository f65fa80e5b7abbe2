// SPDX-License-Identifier: Apache-2.0
#include "visualizer/view/stereo.hpp"

namespace kerf {

namespace {

View beside(const View& middle, double right_mm, double convergence_mm) {
  View eye = middle;
  eye.eye_from_world[3].x -= right_mm;
  eye.middle_right = middle.middle_right - right_mm / convergence_mm;
  return eye;
}

}  // namespace

std::array<View, 2> eye_views(const View& middle, const StereoBase& base) {
  const double half_mm = 0.5 * base.eyes_mm;
  return {beside(middle, -half_mm, base.convergence_mm),
          beside(middle, half_mm, base.convergence_mm)};
}

}  // namespace kerf
