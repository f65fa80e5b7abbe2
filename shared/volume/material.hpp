// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// Parts of voxels by the index of their material; a whole voxel is kDensityMax steps.
using StepsByMaterial = std::vector<std::uint64_t>;

/// Returns the material of a voxel: that of its label; without a label, the densest material whose
/// density the voxel had at the start, or the softest if it reached none. So cutting never changes
/// the material of a voxel. Pictures colour voxels by the same rule.
class MaterialRule {
 public:
  /// Density, 0..1, from which each material shows; index 0 is "none", which no voxel reaches.
  explicit MaterialRule(std::span<const double> isos)
      : count_(std::max<std::size_t>(isos.size(), 1)) {
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t m = 1; m < isos.size(); ++m) order.emplace_back(isos[m], m);
    std::stable_sort(order.begin(), order.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [iso, material] : order) {
      const double from = by_density_.empty() ? 0.0 : std::clamp(iso, 0.0, 1.0) * kDensityMax;
      by_density_.emplace_back(from, material);
    }
    for (const double iso : isos) {
      shows_from_.push_back(static_cast<Density>(std::clamp(iso, 0.0, 1.0) * kDensityMax));
    }
  }

  [[nodiscard]] std::size_t count() const noexcept { return count_; }

  [[nodiscard]] std::size_t of(Label label, Density first) const noexcept {
    if (label > 0 && label < count_) return label;
    std::size_t material = 0;
    for (const auto& [from, index] : by_density_) {
      if (first >= from) material = index;
    }
    return material;
  }

  /// The first density from which a voxel is solid, in a volume with its surface at `iso`. A label
  /// also makes a solid of softer material, such as pulp, from the density at which that shows.
  [[nodiscard]] Density solid_from(Label label, Density iso) const noexcept {
    return label > 0 && label < count_ ? std::min(iso, shows_from_[label]) : iso;
  }

 private:
  std::size_t count_;
  std::vector<std::pair<double, std::size_t>> by_density_;  ///< from the softest
  std::vector<Density> shows_from_;                         ///< by material
};

/// The part of a voxel's solid that is gone, in steps of 1 / kDensityMax, rounded: 1 - now / first.
/// A voxel was solid if its first density reaches `solid_from`; nothing is gone of the others,
/// which are air and tissue below the surface. Cutting takes a part of the density that a voxel
/// has, so one of which a tool covered the part r has lost the part r, whatever its density was.
[[nodiscard]] constexpr std::uint32_t solid_gone(Density first, Density now,
                                                 Density solid_from) noexcept {
  if (first < solid_from || now >= first) return 0;
  constexpr std::uint32_t kWhole = 65535;  // kDensityMax; products below fit in 32 bits
  return (static_cast<std::uint32_t>(first - now) * kWhole + first / 2U) / first;
}

/// Adds to `removed` the solid of a volume with its surface at `iso` that is gone since the start;
/// `labels` may be empty.
inline void add_removed(const MaterialRule& rule, Density iso, std::span<const Density> first,
                        std::span<const Density> now, std::span<const Label> labels,
                        StepsByMaterial& removed) {
  removed.resize(rule.count());
  for (std::size_t i = 0; i < first.size(); ++i) {
    const Label label = labels.empty() ? Label{0} : labels[i];
    const std::uint32_t gone = solid_gone(first[i], now[i], rule.solid_from(label, iso));
    if (gone > 0) removed[rule.of(label, first[i])] += gone;
  }
}

inline constexpr std::size_t kLabelColours = 14;

/// Linear RGB of label `label`, from 1: Okabe and Ito's colours ("Color Universal Design", 2008),
/// which differ for every kind of colour vision, the lightest first, because
/// the first label is usually cut first. After seven they come again, darker; after 14 they repeat.
[[nodiscard]] inline std::array<double, 3> label_colour(std::size_t label) {
  // Those of a screen over 255, to the power of 2.2: written out, since the last bit of std::pow is
  // the C library's.
  constexpr std::array<std::array<double, 3>, 7> kLinear{{
      {0.09151835299891949, 0.4647411349738896, 0.8199637053235279},   // sky blue, 86 180 233
      {0.8751375823652049, 0.7817506777739623, 0.051122050056493396},  // yellow, 240 228 66
      {0.6730490732809419, 0.11129941482466024, 0.0},                  // vermilion, 213 94 0
      {0.0, 0.348864834082879, 0.173439036332135},                     // bluish green, 0 158 115
      {0.6120655998656237, 0.19397216704809314,
       0.39408312608282897},                           // reddish purple, 204 121 167
      {0.0, 0.1701383732233124, 0.4534564754857306},   // blue, 0 114 178
      {0.7969165429079781, 0.35374090009662945, 0.0},  // orange, 230 159 0
  }};
  constexpr double kDarker = 0.18;  // no two of 14 are nearer then, for any kind of vision
  const std::size_t at = (label - 1) % kLabelColours;
  std::array<double, 3> colour{};
  for (std::size_t i = 0; i < 3; ++i) {
    colour[i] = kLinear[at % kLinear.size()][i] * (at < kLinear.size() ? 1 : kDarker);
  }
  return colour;
}

}  // namespace kerf
