// SPDX-License-Identifier: Apache-2.0
#include "visualizer/palette.hpp"

#include <algorithm>
#include <cstddef>

namespace kerf {

namespace {

constexpr glm::dvec3 kIvory{0.80, 0.74, 0.62};
constexpr double kHalfBand = 0.03;  // density; CT noise of dentin is about 0.015

}  // namespace

std::array<std::array<glm::vec4, kPaletteWidth>, 2> make_palette(
    std::span<const MaterialView> materials) {
  std::vector<MaterialView> by_iso;
  if (!materials.empty()) by_iso.assign(materials.begin() + 1, materials.end());
  std::stable_sort(by_iso.begin(), by_iso.end(),
                   [](const MaterialView& a, const MaterialView& b) { return a.iso < b.iso; });

  std::array<std::array<glm::vec4, kPaletteWidth>, 2> palette{};
  for (std::size_t i = 0; i < kPaletteWidth; ++i) {
    const double density = static_cast<double>(i) / (kPaletteWidth - 1);
    glm::dvec3 colour = by_iso.empty() ? kIvory : by_iso.front().colour;
    for (std::size_t m = 1; m < by_iso.size(); ++m) {
      const double iso = by_iso[m].iso;
      const double share = glm::smoothstep(iso - kHalfBand, iso + kHalfBand, density);
      colour = glm::mix(colour, by_iso[m].colour, share);
    }
    palette[0][i] = glm::vec4(glm::vec3(colour), 1.0F);
    palette[1][i] = glm::vec4(glm::vec3(i < materials.size() ? materials[i].colour : kIvory), 1.0F);
  }
  return palette;
}

}  // namespace kerf
