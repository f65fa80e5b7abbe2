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

/// Amounts of density by the index of their material; a full voxel is kDensityMax steps.
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

 private:
  std::size_t count_;
  std::vector<std::pair<double, std::size_t>> by_density_;  ///< from the softest
};

/// Adds to `removed` the density that a volume has lost since the start; `labels` may be empty.
inline void add_removed(const MaterialRule& rule, std::span<const Density> first,
                        std::span<const Density> now, std::span<const Label> labels,
                        StepsByMaterial& removed) {
  removed.resize(rule.count());
  for (std::size_t i = 0; i < first.size(); ++i) {
    if (now[i] >= first[i]) continue;
    removed[rule.of(labels.empty() ? Label{0} : labels[i], first[i])] +=
        static_cast<std::uint64_t>(first[i] - now[i]);
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
