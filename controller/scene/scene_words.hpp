// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "controller/scene/scene.hpp"

namespace kerf {

// The words of a scene for the values of an enumeration, in its order: one list for reading a scene
// and for writing its JSON.
inline constexpr std::array<std::string_view, 2> kForceModelWords = {"paper", "proxy"};
inline constexpr std::array<std::string_view, 4> kCutModelWords = {"none", "overlap",
                                                                   "overlap_exact", "preston"};
inline constexpr std::array<std::string_view, 3> kNumericWords = {"fixed", "float", "double"};
inline constexpr std::array<std::string_view, 3> kGradientWords = {"central", "sobel5", "farid"};

[[nodiscard]] constexpr std::string_view word_of(ForceModel model) {
  return kForceModelWords.at(static_cast<std::size_t>(model));
}
[[nodiscard]] constexpr std::string_view word_of(CutModel model) {
  return kCutModelWords.at(static_cast<std::size_t>(model));
}
[[nodiscard]] constexpr std::string_view word_of(NumericKind numeric) {
  return kNumericWords.at(static_cast<std::size_t>(numeric));
}
[[nodiscard]] constexpr std::string_view word_of(GradientKernel kernel) {
  return kGradientWords.at(static_cast<std::size_t>(kernel));
}

}  // namespace kerf
