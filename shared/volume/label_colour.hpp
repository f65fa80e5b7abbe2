// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace kerf {

inline constexpr std::size_t kLabelColours = 14;

/// Linear RGB of label `label`, from 1: Okabe and Ito's colours ("Color Universal Design", 2008),
/// which differ for every kind of colour vision, the lightest first: what is cut first is seen
/// best. After seven they come once more, darker; after 14 they repeat.
[[nodiscard]] inline std::array<double, 3> label_colour(std::size_t label) {
  constexpr std::array<std::array<double, 3>, 7> kScreen{{{86, 180, 233},   // sky blue
                                                          {240, 228, 66},   // yellow
                                                          {213, 94, 0},     // vermilion
                                                          {0, 158, 115},    // bluish green
                                                          {204, 121, 167},  // reddish purple
                                                          {0, 114, 178},    // blue
                                                          {230, 159, 0}}};  // orange
  constexpr double kGamma = 2.2;
  constexpr double kDarker = 0.18;  // no two of 14 are nearer then, for any kind of vision
  const std::size_t at = (label - 1) % kLabelColours;
  std::array<double, 3> colour{};
  for (std::size_t i = 0; i < 3; ++i) {
    colour[i] = std::pow(kScreen[at % kScreen.size()][i] / 255, kGamma) *
                (at < kScreen.size() ? 1 : kDarker);
  }
  return colour;
}

}  // namespace kerf
