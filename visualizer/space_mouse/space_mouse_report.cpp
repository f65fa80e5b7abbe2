// SPDX-License-Identifier: Apache-2.0
#include "visualizer/space_mouse/space_mouse_report.hpp"

#include <algorithm>
#include <cstddef>

namespace kerf {

namespace {

constexpr std::size_t kThreeAxes = 1 + 3 * 2, kSixAxes = 1 + 6 * 2;  // bytes

/// Three axes from byte `at` on.
std::array<double, 3> axes(std::span<const std::uint8_t> report, std::size_t at) {
  constexpr double kMost = 350;
  std::array<double, 3> all{};
  for (double& axis : all) {
    const auto bits = static_cast<std::uint16_t>(report[at] | report[at + 1] << 8U);
    axis = std::clamp(static_cast<std::int16_t>(bits) / kMost, -1.0, 1.0);
    at += 2;
  }
  return all;
}

}  // namespace

bool take_report(std::span<const std::uint8_t> report, SpaceMouseState& state) noexcept {
  if (report.empty()) return false;
  const std::size_t size = report.size();
  switch (report[0]) {
    case 1:
      if (size != kThreeAxes && size != kSixAxes) return false;
      state.push = axes(report, 1);
      if (size == kSixAxes) state.turn = axes(report, kThreeAxes);
      return true;
    case 2:
      if (size != kThreeAxes) return false;
      state.turn = axes(report, 1);
      return true;
    case 3:
      if (size < 2 || size > 8) return false;
      state.button = (report[1] & 1U) != 0;
      return true;
    default:
      return false;
  }
}

}  // namespace kerf
