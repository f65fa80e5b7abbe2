// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/spacing_check.hpp"

#include <algorithm>
#include <array>
#include <sstream>

namespace kerf {

bool is_stretched(const VolumeFrame& frame) {
  const auto [least, most] = std::ranges::minmax(frame.spacing_mm);
  return most > kMostStretched * least;
}

std::string odd_spacing(const VolumeFrame& frame, const VoxelBox& solid, bool hounsfield) {
  constexpr double kLongestMm = 2000, kShortestMm = 0.5;
  const auto& s = frame.spacing_mm;
  const VoxelIndex extent = solid.extent();
  const std::array<double, 3> size_mm{s[0] * extent.x, s[1] * extent.y, s[2] * extent.z};
  const double longest_mm = *std::ranges::max_element(size_mm);
  const bool placeholder = !hounsfield && s == std::array<double, 3>{1, 1, 1};
  const bool size_is_usual = longest_mm <= kLongestMm && longest_mm >= kShortestMm;
  if (!placeholder && size_is_usual && !is_stretched(frame)) return {};
  std::ostringstream text;
  text << s[0] << " x " << s[1] << " x " << s[2] << " mm "
       << (placeholder ? "(often written where none is known) " : "") << "makes what is solid "
       << size_mm[0] << " x " << size_mm[1] << " x " << size_mm[2] << " mm";
  return text.str();
}

}  // namespace kerf
