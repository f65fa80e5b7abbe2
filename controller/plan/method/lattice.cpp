// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/method/lattice.hpp"

#include <algorithm>
#include <cstddef>

#include "shared/numeric/numbers.hpp"

namespace kerf {

Matrix unturned_steps(const SceneTool& tool, const SceneVolume& volume) {
  constexpr Matrix kAlong{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  const auto& h = volume.image.spacing_mm;
  const double a = tool.pitch_mm;
  return into_volume(tool.round ? kAlong : matrix_of(volume.pose.orientation),
                     {a / h[0], a / h[1], a / h[2]});
}

std::optional<AxisPermutation> axis_permutation(const SceneTool& tool, const SceneVolume& volume) {
  const Matrix steps = unturned_steps(tool, volume);
  AxisPermutation turn{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const std::int32_t step = step_of<FixedNumbers>(steps[i][j]);
      if (step % FixedNumbers::kStepOne != 0) return std::nullopt;
      turn[i][j] = static_cast<std::int16_t>(std::clamp(step / FixedNumbers::kStepOne, -2, 2));
    }
    // One step along one axis: a multiple of the pitch is another lattice.
    const auto& row = turn[i];
    if (row[0] * row[0] + row[1] * row[1] + row[2] * row[2] != 1) return std::nullopt;
  }
  return turn;
}

std::vector<ToolOffset> turned(std::span<const ToolOffset> offsets, const AxisPermutation& turn) {
  std::vector<ToolOffset> result;
  result.reserve(offsets.size());
  for (const ToolOffset& offset : offsets) {
    ToolOffset& out = result.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      out[i] = static_cast<std::int16_t>(turn[i][0] * offset[0] + turn[i][1] * offset[1] +
                                         turn[i][2] * offset[2]);
    }
  }
  return result;
}

}  // namespace kerf
