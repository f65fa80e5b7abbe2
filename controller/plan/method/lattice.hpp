// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "controller/kernel/sampling.hpp"
#include "controller/load/loaded_scene.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

// Matrices of the scene compiler, made in double and rounded to the loop's numbers; and the lattice
// of a tool's samples in a volume.

namespace kerf {

using vec3::Matrix;

[[nodiscard]] inline Matrix matrix_of(const std::array<double, 4>& quaternion) {
  const Matrix3 m = rotation_of(quaternion);
  return {{{m[0], m[1], m[2]}, {m[3], m[4], m[5]}, {m[6], m[7], m[8]}}};
}

/// row_scale * transpose(rotation): world to the volume's axes.
[[nodiscard]] inline Matrix into_volume(const Matrix& rotation,
                                        const std::array<double, 3>& row_scale) {
  Matrix m{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) m[i][j] = row_scale[i] * rotation[j][i];
  }
  return m;
}

template <class S, class To, class From>
[[nodiscard]] Transform<S, To, From> rounded(const Matrix& m) {
  Transform<S, To, From> t;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) t.row[i][j] = S(m[i][j]);
  }
  return t;
}

template <class V, class S>
[[nodiscard]] V rounded(const std::array<double, 3>& v) {
  return {S(v[0]), S(v[1]), S(v[2])};
}

/// Voxels as a step of the loop's numbers.
template <class N>
[[nodiscard]] typename N::Step step_of(double voxels) {
  if constexpr (N::kIsFixed) {
    return static_cast<std::int32_t>(std::lround(voxels * N::kStepOne));
  } else {
    return static_cast<typename N::Step>(voxels);
  }
}

/// Voxels per pitch along each axis of a tool that does not turn. A round tool takes the axes of
/// the volume, whatever its orientation; any other keeps those of the world.
[[nodiscard]] inline Matrix unturned_steps(const SceneTool& tool, const SceneVolume& volume) {
  constexpr Matrix kAlong{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  const auto& h = volume.image.spacing_mm;
  const double a = tool.pitch_mm;
  return into_volume(tool.round ? kAlong : matrix_of(volume.pose.orientation),
                     {a / h[0], a / h[1], a / h[2]});
}

/// The tool's axes in the volume: each along one of its axes, forward (1) or backward (-1).
using AxisPermutation = std::array<std::array<std::int16_t, 3>, 3>;

/// The permutation between the lattice of a tool that does not turn and that of the volume, if the
/// two are equal to the last bit of fixed-point numbers: pitch and voxel edges equal, axes
/// parallel.
[[nodiscard]] inline std::optional<AxisPermutation> axis_permutation(const SceneTool& tool,
                                                                     const SceneVolume& volume) {
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

/// The samples along the axes of the volume.
[[nodiscard]] inline std::vector<ToolOffset> turned(std::span<const ToolOffset> offsets,
                                                    const AxisPermutation& turn) {
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
