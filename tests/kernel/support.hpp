// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/milling.hpp"
#include "controller/kernel/overlap_methods.hpp"
#include "controller/kernel/sampling.hpp"
#include "tests/rig/geometry.hpp"

/// Analytic volumes, tools and poses for the kernel tests.
namespace kerf::test {

using TestVolume = extremes::Body;
using extremes::made_of;

inline TestVolume filled(VoxelGrid grid, Density value) {
  return {grid, std::vector<Density>(grid.voxel_count(), value)};
}

/// Density from a signed distance in voxels (negative inside), antialiased over one voxel: a voxel
/// whose centre lies on the face has half the density.
template <class Distance>
TestVolume solid(VoxelGrid grid, Distance&& distance_vox) {
  return made_of(grid, [&](std::int32_t x, std::int32_t y, std::int32_t z) {
    const double inside = 0.5 - distance_vox(double(x), double(y), double(z));
    return static_cast<Density>(std::lround(kDensityMax * std::min(1.0, std::max(0.0, inside))));
  });
}

inline TestVolume random_volume(VoxelGrid grid, std::uint32_t seed) {
  std::mt19937 random(seed);
  return made_of(grid, [&](auto, auto, auto) { return static_cast<Density>(random() >> 16); });
}

inline std::uint64_t total_density(const TestVolume& volume) {
  std::uint64_t total = 0;
  for (const Density rho : volume.density) total += rho;
  return total;
}

template <class N = FixedNumbers>
std::vector<Gradient<N>> gradients(GradientKernel kernel, const TestVolume& volume) {
  std::vector<Gradient<N>> field(volume.grid.voxel_count());
  GradientScratch scratch;
  refresh_gradients<N>(kernel, volume.grid, volume.density, volume.grid.box(), field, scratch);
  return field;
}

/// Every voxel of a box.
inline std::vector<ToolOffset> box_tool(int nx, int ny, int nz) {
  std::vector<ToolOffset> offsets;
  for (int z = 1 - nz; z < nz; z += 2) {
    for (int y = 1 - ny; y < ny; y += 2) {
      for (int x = 1 - nx; x < nx; x += 2) {
        offsets.push_back({static_cast<std::int16_t>(x), static_cast<std::int16_t>(y),
                           static_cast<std::int16_t>(z)});
      }
    }
  }
  return offsets;
}

/// Samples of a ball around the origin, on whole pitches: 515 for a radius of 5.
inline std::vector<ToolOffset> odd_ball(int radius_pitches) {
  std::vector<ToolOffset> offsets;
  const int r = radius_pitches;
  for (int z = -r; z <= r; ++z) {
    for (int y = -r; y <= r; ++y) {
      for (int x = -r; x <= r; ++x) {
        if (x * x + y * y + z * z > r * r) continue;
        offsets.push_back({static_cast<std::int16_t>(2 * x), static_cast<std::int16_t>(2 * y),
                           static_cast<std::int16_t>(2 * z)});
      }
    }
  }
  return offsets;
}

/// The paper's ball in a cube of `size` voxels: 2176 samples for 16, 552 for 10.
inline std::vector<ToolOffset> paper_ball(int size) {
  std::vector<ToolOffset> offsets;
  for (int z = 1 - size; z < size; z += 2) {
    for (int y = 1 - size; y < size; y += 2) {
      for (int x = 1 - size; x < size; x += 2) {
        if (x * x + y * y + z * z > size * size) continue;
        offsets.push_back({static_cast<std::int16_t>(x), static_cast<std::int16_t>(y),
                           static_cast<std::int16_t>(z)});
      }
    }
  }
  return offsets;
}

template <class N = FixedNumbers>
typename N::Step step_from(double voxels) {
  if constexpr (N::kIsFixed) {
    return static_cast<typename N::Step>(std::lround(voxels * N::kStepOne));
  } else {
    return static_cast<typename N::Step>(voxels);
  }
}

template <class N = FixedNumbers>
ToolPose<N> pose_at(std::array<double, 3> centre_vox, double pitch_vox = 1.0) {
  using Real = typename N::Real;
  ToolPose<N> pose;
  pose.centre_vox = {Real(centre_vox[0]), Real(centre_vox[1]), Real(centre_vox[2])};
  for (std::size_t axis = 0; axis < 3; ++axis) pose.step[axis][axis] = step_from<N>(pitch_vox);
  return pose;
}

/// Turned by the quaternion (x, y, z, w), any length but zero.
template <class N = FixedNumbers>
ToolPose<N> turned_pose(std::array<double, 3> centre_vox, std::array<double, 4> q,
                        double pitch_vox = 1.0) {
  ToolPose<N> pose = pose_at<N>(centre_vox);
  const auto [x, y, z, w] = q;
  const double s = 2.0 / (x * x + y * y + z * z + w * w);
  const double rotation[3][3] = {
      {1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)},
      {s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)},
      {s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)}};
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = 0; b < 3; ++b) pose.step[a][b] = step_from<N>(rotation[a][b] * pitch_vox);
  }
  return pose;
}

/// Contact sum in fractions of full density: SUM_i grad(rho / rho_max), per voxel.
template <class N>
std::array<double, 3> contact_gradient(const TestVolume& volume, std::span<const Gradient<N>> field,
                                       std::span<const ToolOffset> offsets,
                                       const ToolPose<N>& pose) {
  const SumVec<N> sum = contact_sum<N>(volume.grid, field, offsets, pose);
  const double scale = 1.0 / (kDensityMax * double(N::kWeightOne));
  return {double(sum.x) * scale, double(sum.y) * scale, double(sum.z) * scale};
}

/// A tool's cutting memory: overlap box, removal carry.
template <class N = FixedNumbers>
struct Cutter {
  explicit Cutter(std::size_t width = 64)
      : memory(width * width * width), carry(removal_lanes(width)), overlap{memory, {}, 0} {}
  Cutter(const Cutter&) = delete;
  Cutter& operator=(const Cutter&) = delete;

  std::vector<typename N::Weight> memory;
  std::vector<RemovalCarry<N>> carry;
  OverlapBox<N> overlap;
};

/// One cut at a pose, without forces.
template <class N>
Removed cut(TestVolume& volume, std::span<const ToolOffset> offsets, const ToolPose<N>& pose,
            const RemovalRate<N>& rate, Cutter<N>& cutter,
            typename N::Step volume_ratio = N::kStepOne) {
  overlap<N>(volume.grid, offsets, pose, volume_ratio, cutter.overlap);
  return remove<N>(volume.grid, volume.density, cutter.overlap, rate, cutter.carry);
}

}  // namespace kerf::test
