// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "controller/kernel/sampling.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "shared/volume/voxel_grid.hpp"

// Volumes, tools and places of the benchmarks.
namespace kerf::bench {

using Place = vec3::Vec;
using vec3::Matrix;

/// A value that the compiler must compute.
inline volatile std::int64_t g_sink = 0;
inline void use(std::int64_t value) {
  g_sink = value;
}

/// Densities from the depth below the surface in voxels, antialiased over two of them.
template <class Depth>
[[nodiscard]] std::vector<Density> densities(const VoxelGrid& grid, Depth&& depth_vox) {
  std::vector<Density> density;
  density.reserve(grid.voxel_count());
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = 0; y < grid.ny; ++y) {
      for (std::int32_t x = 0; x < grid.nx; ++x) {
        const double share = 0.5 + depth_vox(x, y, z) / 2;
        density.push_back(
            static_cast<Density>(std::lround(kDensityMax * std::clamp(share, 0.0, 1.0))));
      }
    }
  }
  return density;
}

/// A ball of 40 voxels in the middle.
[[nodiscard]] inline std::vector<Density> ball_in(const VoxelGrid& grid) {
  return densities(grid, [&](double x, double y, double z) {
    return 40 - std::hypot(x - grid.nx * 0.5, y - grid.ny * 0.5, z - grid.nz * 0.5);
  });
}

/// Around that ball, dipping 2 voxels into it.
[[nodiscard]] inline Place around(const VoxelGrid& grid, int size, int i, int count) {
  const double angle = 2 * std::numbers::pi * i / count, radius = 40 + size * 0.5 - 2;
  return {grid.nx * 0.5 + radius * std::cos(angle), grid.ny * 0.5 + radius * std::sin(angle),
          grid.nz * 0.5};
}

enum class Shape { ball, cube };

/// All voxels of a cube of `size`, or those of the ball in it.
[[nodiscard]] inline std::vector<ToolOffset> tool_of(int size, Shape shape) {
  std::vector<ToolOffset> offsets;
  for (int z = 1 - size; z < size; z += 2) {
    for (int y = 1 - size; y < size; y += 2) {
      for (int x = 1 - size; x < size; x += 2) {
        if (shape == Shape::ball && x * x + y * y + z * z > size * size) continue;
        offsets.push_back({static_cast<std::int16_t>(x), static_cast<std::int16_t>(y),
                           static_cast<std::int16_t>(z)});
      }
    }
  }
  return offsets;
}

[[nodiscard]] inline Matrix orientation_of(double yaw, double pitch) {
  const double a = std::cos(yaw), b = std::sin(yaw), c = std::cos(pitch), d = std::sin(pitch);
  return {{{a * c, -b, a * d}, {b * c, a, b * d}, {-d, 0, c}}};
}
inline constexpr Matrix kUnturned{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

[[nodiscard]] inline ToolPose<FixedNumbers> pose_of(const Place& p, const Matrix& rotation) {
  ToolPose<FixedNumbers> pose;
  pose.centre_vox = {Q16(p[0]), Q16(p[1]), Q16(p[2])};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      pose.step[i][j] =
          static_cast<std::int32_t>(std::lround(rotation[i][j] * FixedNumbers::kStepOne));
    }
  }
  return pose;
}

/// More than any last-level cache in question.
inline void sweep_cache() {
  static std::vector<std::uint64_t> memory((96U << 20) / sizeof(std::uint64_t), 1);
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < memory.size(); i += 8) sum += memory[i]++;
  use(static_cast<std::int64_t>(sum));
}

}  // namespace kerf::bench
