// SPDX-License-Identifier: Apache-2.0
#include "visualizer/view/palette.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace kerf {

namespace {

constexpr double kHalfBand = 0.03;  // density; CT noise of dentin is about 0.015
// Per voxel edge. Enamel lets what is below shine through; behind a millimetre of dentin little
// does.
constexpr double kHardestOpacity = 0.10;
constexpr double kSoftestOpacity = 0.40;
constexpr glm::dvec4 kIvory{0.80, 0.74, 0.62, kSoftestOpacity};

/// Colour and opacity of each material, from the softest to the hardest.
struct Look {
  double iso;
  std::size_t label;
  glm::dvec4 colour;
};

std::vector<Look> looks_of(std::span<const MaterialView> materials) {
  std::vector<Look> looks;
  for (std::size_t m = 1; m < materials.size(); ++m) {
    const double opacity = materials[m].opacity.value_or(default_opacity(materials, m));
    looks.push_back({materials[m].iso, m, glm::dvec4(materials[m].colour, opacity)});
  }
  std::stable_sort(looks.begin(), looks.end(),
                   [](const Look& a, const Look& b) { return a.iso < b.iso; });
  return looks;
}

}  // namespace

double default_opacity(std::span<const MaterialView> materials, std::size_t index) {
  if (materials.size() < 3) return kSoftestOpacity;
  // In equal ratios from the softest to the hardest; among equals the first is the softer.
  std::size_t softer = 0;
  for (std::size_t m = 1; m < materials.size(); ++m) {
    const double iso = materials[m].iso;
    if (iso < materials[index].iso || (iso == materials[index].iso && m < index)) ++softer;
  }
  const double rank = static_cast<double>(softer) / static_cast<double>(materials.size() - 2);
  return kSoftestOpacity * std::pow(kHardestOpacity / kSoftestOpacity, rank);
}

Palette make_palette(std::span<const MaterialView> materials) {
  const std::vector<Look> looks = looks_of(materials);
  Palette palette{};
  for (std::size_t i = 0; i < kPaletteWidth; ++i) {
    const double density = static_cast<double>(i) / (kPaletteWidth - 1);
    glm::dvec4 colour = looks.empty() ? kIvory : looks.front().colour;
    for (std::size_t m = 1; m < looks.size(); ++m) {
      const double iso = looks[m].iso;
      const double share = glm::smoothstep(iso - kHalfBand, iso + kHalfBand, density);
      colour = glm::mix(colour, looks[m].colour, share);
    }
    palette[0][i] = glm::vec4(colour);
    palette[1][i] = glm::vec4(kIvory);
  }
  for (const Look& look : looks) {
    if (look.label < kPaletteWidth) palette[1][look.label] = glm::vec4(look.colour);
  }
  if (!materials.empty()) palette[1][0] = glm::vec4(glm::vec3(materials[0].colour), 0.0F);
  return palette;
}

}  // namespace kerf
