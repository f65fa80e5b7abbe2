// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <glm/glm.hpp>

namespace kerf {

/// The normal in eye space that a pixel drawn with normals.frag holds, to 1/4096.
[[nodiscard]] inline glm::dvec3 shown_normal(const std::uint8_t* rgb) {
  const int bits = rgb[0] << 16 | rgb[1] << 8 | rgb[2];
  const glm::dvec2 n = 2.0 * glm::dvec2(bits >> 12, bits & 0xfff) / 4095.0 - 1.0;
  return {n, std::sqrt(std::max(0.0, 1.0 - glm::dot(n, n)))};
}

}  // namespace kerf
