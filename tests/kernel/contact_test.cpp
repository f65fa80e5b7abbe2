// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "controller/kernel/overlap_methods.hpp"
#include "tests/kernel/support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

/// The definition once more, without cells: hat weights of every voxel, in double.
std::array<double, 3> obvious_contact(const TestVolume& volume,
                                      std::span<const Gradient<DoubleNumbers>> field,
                                      std::span<const ToolOffset> offsets,
                                      const ToolPose<DoubleNumbers>& pose) {
  const VoxelGrid& grid = volume.grid;
  std::array<double, 3> sum{};
  for (const ToolOffset& offset : offsets) {
    const auto at = sample_position(pose, offset);
    const auto in = [](double p, std::int32_t n) { return p >= 0 && p < n - 1; };
    if (!in(at.x, grid.nx) || !in(at.y, grid.ny) || !in(at.z, grid.nz)) continue;
    for (std::int32_t z = 0; z < grid.nz; ++z) {
      for (std::int32_t y = 0; y < grid.ny; ++y) {
        for (std::int32_t x = 0; x < grid.nx; ++x) {
          const double w = std::max(0.0, 1 - std::abs(at.x - x)) *
                           std::max(0.0, 1 - std::abs(at.y - y)) *
                           std::max(0.0, 1 - std::abs(at.z - z));
          const auto& g = field[grid.index(x, y, z)];
          sum[0] += w * g.x;
          sum[1] += w * g.y;
          sum[2] += w * g.z;
        }
      }
    }
  }
  return sum;
}

}  // namespace

TEST_CASE("fixed and double differ by at most 1.7e-4 of full scale, at any pose") {
  const TestVolume ball_volume = solid({40, 40, 40}, [](double x, double y, double z) {
    return std::hypot(x - 19.3, y - 20.1, z - 20.4) - 12.0;
  });
  const auto fixed = gradients<FixedNumbers>(GradientKernel::farid, ball_volume);
  const auto exact = gradients<DoubleNumbers>(GradientKernel::farid, ball_volume);
  const auto tool = odd_ball(5);
  constexpr double kFullScale = 75.0;  // largest F / p0 of this tool on a flat
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(5.0, 35.0), turn(-1.0, 1.0);
  double worst = 0;
  for (int n = 0; n < 2000; ++n) {
    const std::array<double, 3> centre{place(random), place(random), place(random)};
    const std::array<double, 4> q{turn(random), turn(random), turn(random), turn(random) + 1.5};
    const auto a = contact_gradient<FixedNumbers>(ball_volume, fixed, tool,
                                                  turned_pose<FixedNumbers>(centre, q));
    const auto b = contact_gradient<DoubleNumbers>(ball_volume, exact, tool,
                                                   turned_pose<DoubleNumbers>(centre, q));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      worst = std::max(worst, std::abs(a[axis] - b[axis]) / kFullScale);
    }
  }
  MESSAGE("largest difference: " << worst << " of full scale");
  CHECK(worst <= 1.7e-4);
}

// N7
TEST_CASE("the order of the samples does not change a fixed sum") {
  const TestVolume volume = random_volume({30, 30, 30}, 11);
  const auto field = gradients<FixedNumbers>(GradientKernel::farid, volume);
  auto tool = paper_ball(10);
  const auto pose = turned_pose<FixedNumbers>({14.3, 15.2, 13.9}, {0.3, -0.2, 0.5, 0.8});
  const auto first = contact_sum<FixedNumbers>(volume.grid, field, tool, pose);
  std::mt19937 random(7);
  bool same = true;
  for (int n = 0; n < 1000; ++n) {
    std::shuffle(tool.begin(), tool.end(), random);
    same = same && contact_sum<FixedNumbers>(volume.grid, field, tool, pose) == first;
  }
  CHECK(same);
}

TEST_CASE("samples count when their cell is inside the volume and not otherwise") {
  CHECK(rc::check([](std::uint32_t seed) {
    const VoxelGrid grid{*rc::gen::inRange(1, 9), *rc::gen::inRange(1, 8), *rc::gen::inRange(1, 7)};
    const TestVolume volume = random_volume(grid, seed);
    const auto field = gradients<DoubleNumbers>(GradientKernel::sobel5, volume);
    const auto place = [] { return double(*rc::gen::inRange(-4000, 12000)) / 1000.0; };
    const double x = place(), y = place(), z = place();
    const auto pose = turned_pose<DoubleNumbers>({x, y, z}, {0.1, 0.2, -0.4, 0.9});
    const auto tool = odd_ball(2);
    const auto sum = contact_sum<DoubleNumbers>(grid, field, tool, pose);
    const auto expected = obvious_contact(volume, field, tool, pose);
    RC_ASSERT(std::abs(sum.x - expected[0]) < 1e-6);
    RC_ASSERT(std::abs(sum.y - expected[1]) < 1e-6);
    RC_ASSERT(std::abs(sum.z - expected[2]) < 1e-6);
  }));
}

TEST_CASE_TEMPLATE("a tool far outside, at the range ends or nowhere feels nothing", N,
                   FixedNumbers, DoubleNumbers) {
  const TestVolume volume = random_volume({9, 8, 7}, 2);
  const auto field = gradients<N>(GradientKernel::farid, volume);
  const auto tool = odd_ball(3);
  const double inf = std::numeric_limits<double>::infinity();
  for (const double far : {-40.0, 40.0, -1e9, 1e9, -inf, inf}) {
    CHECK(contact_sum<N>(volume.grid, field, tool, pose_at<N>({far, 4, 3})) == SumVec<N>{});
    CHECK(contact_sum<N>(volume.grid, field, tool, pose_at<N>({far, far, far})) == SumVec<N>{});
  }
  CHECK(contact_sum<N>(volume.grid, field, {}, pose_at<N>({4, 4, 3})) == SumVec<N>{});
  if constexpr (!N::kIsFixed) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK(contact_sum<N>(volume.grid, field, tool, pose_at<N>({4, nan, 3})) == SumVec<N>{});
  }
}
