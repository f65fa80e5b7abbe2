// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "controller/kernel/sampling.hpp"
#include "tests/kernel/support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

template <class N>
VoxelVec<typename N::Unit> direction(double x, double y, double z) {
  using Unit = typename N::Unit;
  return {Unit(x), Unit(y), Unit(z)};
}

}  // namespace

TEST_CASE_TEMPLATE("a ball in a flat is as deep as it is sunk, within a pitch", N, FixedNumbers,
                   DoubleNumbers) {
  const TestVolume volume = solid({40, 40, 40}, [](double, double, double z) { return z - 20.0; });
  for (const double pitch : {1.0, 0.5, 0.25}) {
    const auto ball = odd_ball(static_cast<int>(6 / pitch));
    for (double depth = 0.6; depth < 12; depth += 0.37) {
      const double felt = double(penetration_extent<N>(volume.grid, volume.density, ball,
                                                       pose_at<N>({20, 20, 26 - depth}, pitch),
                                                       32768, direction<N>(0, 0, 1)));
      CHECK(felt > depth + 0.5 - pitch - 1e-4);
      CHECK(felt <= depth + 0.5 + 1e-4);
    }
  }
}

TEST_CASE_TEMPLATE("depth is measured along the normal, in its units and whatever its sign", N,
                   FixedNumbers, DoubleNumbers) {
  const TestVolume volume = filled({40, 40, 40}, 65535);
  const auto ball = odd_ball(5);
  const auto extent = [&](VoxelVec<typename N::Unit> normal) {
    return double(penetration_extent<N>(volume.grid, volume.density, ball,
                                        turned_pose<N>({20, 20, 20}, {0.5, 0.5, 0.5, 0.5}), 1,
                                        normal));
  };
  CHECK(extent(direction<N>(0, 0, 1)) == doctest::Approx(10).epsilon(1e-4));
  CHECK(extent(direction<N>(0, -1, 0)) == doctest::Approx(10).epsilon(1e-4));
  CHECK(extent(direction<N>(0.125, 0, 0)) == doctest::Approx(1.25).epsilon(1e-4));
  CHECK(extent(direction<N>(0.6, 0.8, 0)) == doctest::Approx(10).epsilon(1e-4));
}

TEST_CASE_TEMPLATE("no depth in air, outside the volume or without samples", N, FixedNumbers,
                   DoubleNumbers) {
  const TestVolume volume = solid({40, 40, 40}, [](double, double, double z) { return z - 20.0; });
  const auto ball = odd_ball(3);
  const auto felt = [&](std::span<const ToolOffset> tool, double z) {
    return double(penetration_extent<N>(volume.grid, volume.density, tool, pose_at<N>({20, 20, z}),
                                        32768, direction<N>(0, 0, 1)));
  };
  CHECK(felt(ball, 30) == 0.0);
  CHECK(felt(ball, -50) == 0.0);
  CHECK(felt(ball, 1e9) == 0.0);
  CHECK(felt({}, 10) == 0.0);
  CHECK(felt(ball, 10) == 6.0);
}
