// SPDX-License-Identifier: Apache-2.0
#include "visualizer/transfer_function.hpp"

#include <algorithm>
#include <cmath>

namespace kerf {

namespace {

constexpr double kEmptyShare = 0.4;    // the ramp begins at this share of the density where it ends
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
                                        bool has_labels) {
  TransferFunction made{.materials = make_palette(materials)};
  made.full = has_labels && materials.size() > 1 ? kWholeSoftest * softest_iso(materials)
                                                 : iso / kDensityMax;
  made.full = std::clamp(made.full, 2.0 / kEightBits, 1.0);
  made.empty = kEmptyShare * made.full;
  return made;
}

}  // namespace kerf
