// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "visualizer/view/camera.hpp"

namespace kerf {

/// The convex polygon in which the plane `eye_mm` away along the view axis cuts a box given by its
/// corners in eye space (bit 0 of the index: high x, bit 1: high y, bit 2: high z). At most six
/// vertices (x, y), in order around; fewer than three where the plane misses the box.
[[nodiscard]] std::vector<glm::dvec2> cut_box(const BoxCorners& eye_corners, double eye_mm);

}  // namespace kerf
