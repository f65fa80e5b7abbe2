// SPDX-License-Identifier: Apache-2.0
#include "visualizer/view/transfer_function.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace kerf {

namespace {

constexpr double kEmptyShare = 0.4;  // the ramp begins at this share of the way from air to its end
constexpr double kHighestAir = 0.75;   // of the density where it ends: else hardly a ramp is left
constexpr double kWholeSoftest = 2.0;  // an iso density is half-way up to a material
constexpr double kEightBits = 255.0;

double softest_iso(std::span<const MaterialView> materials) {
  const auto softer = [](const MaterialView& a, const MaterialView& b) { return a.iso < b.iso; };
  return std::min_element(materials.begin() + 1, materials.end(), softer)->iso;
}

}  // namespace

double TransferFunction::presence(double density) const noexcept {
  return std::clamp((density - empty) / (full - empty), 0.0, 1.0);
}

Density TransferFunction::lowest_seen() const noexcept {
  const double seen = std::max(0.0, empty - 0.5 / kEightBits) * kDensityMax;
  return static_cast<Density>(std::max(1.0, std::floor(seen)));
}

TransferFunction make_transfer_function(std::span<const MaterialView> materials, Density iso,
                                        bool has_labels, Density air) {
  TransferFunction made{.materials = make_palette(materials)};
  made.full = has_labels && materials.size() > 1 ? kWholeSoftest * softest_iso(materials)
                                                 : iso / kDensityMax;
  made.full = std::clamp(made.full, 2.0 / kEightBits, 1.0);
  const double empty_of_all = std::min(air / kDensityMax, kHighestAir * made.full);
  made.empty = empty_of_all + kEmptyShare * (made.full - empty_of_all);
  return made;
}

TransferFunction make_transfer_function(const SceneView& scene, std::size_t volume,
                                        const VolumeContent& content) {
  const Density iso = scene.volumes[volume].iso;
  if (!content.labels.empty()) return make_transfer_function(scene.materials, iso, true);
  return make_transfer_function(scene.materials, iso, false, air_level(content.density, iso));
}

Density air_level(std::span<const Density> density, Density iso) {
  constexpr std::size_t kEnough = 1U << 20;
  const std::size_t step = density.size() / kEnough | 1U;  // odd: not one column of all rows
  std::array<std::size_t, 256> counts{};                   // by the upper 8 bits
  std::size_t below = 0;
  for (std::size_t i = 0; i < density.size(); i += step) {
    if (density[i] >= iso) continue;
    ++counts[density[i] >> 8];
    ++below;
  }
  std::size_t median = 0;
  for (std::size_t passed = counts[0]; 2 * passed < below; passed += counts[median]) ++median;
  return static_cast<Density>(median << 8);
}

}  // namespace kerf
