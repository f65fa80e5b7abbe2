// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "visualizer/view/gradient.hpp"

namespace kerf {

/// The normal in eye space that a pixel drawn with normals.frag holds, to 1/4096.
[[nodiscard]] inline glm::dvec3 shown_normal(const std::uint8_t* rgb) {
  const int bits = rgb[0] << 16 | rgb[1] << 8 | rgb[2];
  const glm::dvec2 n = 2.0 * glm::dvec2(bits >> 12, bits & 0xfff) / 4095.0 - 1.0;
  return {n, std::sqrt(std::max(0.0, 1.0 - glm::dot(n, n)))};
}

/// What one way to take the gradient does to the normals of `iso`.
struct GradientRow {
  Gradient gradient;
  double angle_deg;        ///< root mean square, on a ball
  double noisy_angle_deg;  ///< the same with noise in the density
};

/// Measures each on an analytic ball of 28 voxels radius whose border is antialiased over two, as
/// tools and teeth are, in the shader's own normals; without noise, and with the 1.5 % of full
/// density that a CT of dentin has. Pixels seen at less than 20 degrees do not count. Needs a
/// current GL context.
[[nodiscard]] std::vector<GradientRow> measure_gradients();

}  // namespace kerf
