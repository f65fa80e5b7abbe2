// SPDX-License-Identifier: Apache-2.0
#include "controller/kernel/gradient.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <doctest/doctest.h>

#include "tests/kernel/definitions.hpp"
#include "tests/kernel/support.hpp"
#include "tests/support/property.hpp"
#include "tests/support/voxels.hpp"

namespace kerf::gradient_test {

using namespace kerf::test;

namespace {

constexpr std::array kKernels = {GradientKernel::central, GradientKernel::sobel5,
                                 GradientKernel::farid};

/// A ramp along one axis, `slope` density steps per voxel.
TestVolume ramp(int axis, int slope) {
  return made_of({13, 13, 13}, [&](std::int32_t x, std::int32_t y, std::int32_t z) {
    return static_cast<Density>(slope * (axis == 0 ? x : axis == 1 ? y : z));
  });
}

struct Angles {
  double rms_deg = 0, worst_deg = 0;
};

/// Angle between the gradient and the true normal at the voxels on the surface of a ball.
Angles direction_error(GradientKernel kernel) {
  const std::array<double, 3> centre = {20.37, 20.11, 19.77};
  const auto distance = [&](double x, double y, double z) {
    return std::hypot(x - centre[0], y - centre[1], z - centre[2]) - 10.0;
  };
  const TestVolume ball = solid({41, 41, 41}, distance);
  const auto field = gradients(kernel, ball);
  Angles angles;
  int count = 0;
  for (const auto& [x, y, z] : voxels(VoxelBox{{0, 0, 0}, {41, 41, 41}})) {
    if (std::abs(distance(x, y, z)) > 0.5) continue;
    const auto& g = field[ball.grid.index(x, y, z)];
    const VoxelVec<double> normal{x - centre[0], y - centre[1], z - centre[2]};
    const VoxelVec<double> out{-double(g.x), -double(g.y), -double(g.z)};
    const double cosine = dot(normal, out) / (norm(normal) * norm(out));
    const double angle = std::acos(std::min(1.0, cosine)) * 180 / std::numbers::pi;
    angles.rms_deg += angle * angle;
    angles.worst_deg = std::max(angles.worst_deg, angle);
    ++count;
  }
  angles.rms_deg = std::sqrt(angles.rms_deg / count);
  return angles;
}

}  // namespace

// N1
TEST_CASE("a ramp has its slope as gradient: exactly for central and Sobel, 0.9998159 for Farid") {
  constexpr int kSlope = 4096;
  for (int axis = 0; axis < 3; ++axis) {
    const TestVolume volume = ramp(axis, kSlope);
    for (const GradientKernel kernel : kKernels) {
      const bool farid = kernel == GradientKernel::farid;
      const auto exact =
          gradient_dense<DoubleNumbers>(kernel, volume.grid, volume.density, {6, 6, 6});
      const double expected = farid ? kSlope * (2096766.0 / 2097152.0) : kSlope;
      CHECK((axis == 0 ? exact.x : axis == 1 ? exact.y : exact.z) == expected);
      CHECK(exact.x + exact.y + exact.z == expected);
      const auto fixed =
          gradient_dense<FixedNumbers>(kernel, volume.grid, volume.density, {6, 6, 6});
      CHECK(fixed.x + fixed.y + fixed.z == (farid ? 4095 : kSlope));
    }
  }
}

// N3
TEST_CASE("direction error on the surface of a ball of radius 10 is that of the kernel") {
  const Angles central = direction_error(GradientKernel::central);
  CHECK(central.rms_deg == doctest::Approx(8.1).epsilon(0.05));
  CHECK(central.worst_deg == doctest::Approx(15.1).epsilon(0.05));
  const Angles sobel = direction_error(GradientKernel::sobel5);
  CHECK(sobel.rms_deg == doctest::Approx(0.83).epsilon(0.05));
  CHECK(sobel.worst_deg == doctest::Approx(2.0).epsilon(0.05));
  const Angles farid = direction_error(GradientKernel::farid);
  CHECK(farid.rms_deg == doctest::Approx(0.57).epsilon(0.05));
  CHECK(farid.worst_deg == doctest::Approx(1.53).epsilon(0.05));
}

// N2
TEST_CASE("noise passes into the gradient by the kernel's own figure") {
  std::mt19937 random(64);
  std::normal_distribution<double> normal;
  constexpr double kNoise = 4000;  // steps; eight of them fit on both sides of the middle
  const TestVolume volume = made_of({64, 64, 64}, [&](auto, auto, auto) {
    return static_cast<Density>(std::lround(32768 + kNoise * normal(random)));
  });
  const auto gain = [&](GradientKernel kernel) {
    const auto field = gradients(kernel, volume);
    double square = 0;
    int count = 0;
    for (const auto& [x, y, z] : voxels(VoxelBox{{2, 2, 2}, {62, 62, 62}})) {
      const auto& g = field[volume.grid.index(x, y, z)];
      for (const double part : {g.x, g.y, g.z}) square += part * part;
      count += 3;
    }
    return std::sqrt(square / count) / kNoise;
  };
  CHECK(gain(GradientKernel::central) == doctest::Approx(0.7071).epsilon(0.02));
  CHECK(gain(GradientKernel::sobel5) == doctest::Approx(0.108).epsilon(0.02));
  CHECK(gain(GradientKernel::farid) == doctest::Approx(0.1302).epsilon(0.02));
}

// N4
TEST_CASE_TEMPLATE("separable gradients have the bits of the dense sum, across tile seams", N,
                   FixedNumbers, DoubleNumbers) {
  // Wider than two tiles along x, one and a bit along y.
  const TestVolume volume = random_volume({70, 37, 9}, 1);
  for (const GradientKernel kernel : kKernels) {
    const auto field = gradients<N>(kernel, volume);
    std::size_t different = 0;
    for (const auto& [x, y, z] : voxels(volume.grid)) {
      const auto dense = gradient_dense<N>(kernel, volume.grid, volume.density, {x, y, z});
      if (!(dense == field[volume.grid.index(x, y, z)])) ++different;
    }
    CHECK(different == 0);
  }
}

// N4
TEST_CASE("refreshing the changed box gives the same field as computing all of it again") {
  CHECK(property([] {
    const auto seed = any<std::uint32_t>();
    const VoxelGrid grid{in_range(1, 45), in_range(1, 40), in_range(1, 12)};
    const auto kernel = kKernels[in_range<std::size_t>(0, kKernels.size())];
    TestVolume volume = random_volume(grid, seed);
    auto field = gradients(kernel, volume);
    // A box that may stick out of the volume or be empty; densities change only inside both.
    const VoxelIndex low{in_range(-3, grid.nx), in_range(-3, grid.ny), in_range(-3, grid.nz)};
    const VoxelBox changed{
        low, {low.x + in_range(0, 40), low.y + in_range(0, 40), low.z + in_range(0, 12)}};
    std::mt19937 random(seed + 1);
    const VoxelBox inside = changed.clipped(grid.box());
    for (std::int32_t z = inside.lo.z; z < inside.hi.z; ++z) {
      for (std::int32_t y = inside.lo.y; y < inside.hi.y; ++y) {
        for (std::int32_t x = inside.lo.x; x < inside.hi.x; ++x) {
          volume.density[grid.index(x, y, z)] = static_cast<Density>(random());
        }
      }
    }
    GradientScratch scratch;
    refresh_gradients<FixedNumbers>(kernel, grid, volume.density, changed, field, scratch);
    HOLDS(field == gradients(kernel, volume));
  }));
}

TEST_CASE("the steepest volume a kernel can meet stays within 16 bits") {
  // 65535 where the tap product has the wanted sign, 0 elsewhere: no volume gives more.
  const auto steepest = [](GradientKernel kernel, bool rising) {
    const GradientTaps tap = taps(kernel);
    const TestVolume volume = made_of({5, 5, 5}, [&](auto x, auto y, auto z) {
      const auto product = tap.slope[static_cast<std::size_t>(x)] *
                           tap.smooth[static_cast<std::size_t>(y)] *
                           tap.smooth[static_cast<std::size_t>(z)];
      return static_cast<Density>((rising ? product > 0 : product < 0) ? 65535 : 0);
    });
    const auto field = gradients(kernel, volume);
    const auto middle = volume.grid.index(2, 2, 2);
    CHECK(field[middle] ==
          gradient_dense<FixedNumbers>(kernel, volume.grid, volume.density, {2, 2, 2}));
    return field[middle].x;
  };
  CHECK(steepest(GradientKernel::farid, true) == 25481);
  CHECK(steepest(GradientKernel::farid, false) == -25481);
  CHECK(steepest(GradientKernel::sobel5, true) == 24576);
  CHECK(steepest(GradientKernel::sobel5, false) == -24576);
  CHECK(steepest(GradientKernel::central, true) == 32767);  // 32767.5, kept in range
  CHECK(steepest(GradientKernel::central, false) == -32767);
}

}  // namespace kerf::gradient_test
