// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <doctest/doctest.h>

#include "controller/kernel/point_shell/free_path.hpp"
#include "controller/plan/tables/free_brick_map.hpp"
#include "tests/case_count.hpp"
#include "tests/kernel/contact_support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

constexpr VoxelGrid kGrid{50, 40, 45};

/// How far the sphere of `radius` about `p` is from where a voxel of `hot` is read: around it, but
/// for what is beyond the outermost voxels.
double gap(const std::vector<Point>& hot, const Point& p, double radius) {
  const double last[3] = {kGrid.nx - 1.0, kGrid.ny - 1.0, kGrid.nz - 1.0};
  double nearest = 1e9;
  for (const Point& v : hot) {
    Point out{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double low = std::max(v[axis] - 1, 0.0), high = std::min(v[axis] + 1, last[axis]);
      out[axis] = std::max({0.0, low - p[axis], p[axis] - high});
    }
    nearest = std::min(nearest, length(out));
  }
  return nearest - radius;
}

template <class N>
PointNumber<N> number(double x) {
  return static_cast<PointNumber<N>>(N::kIsFixed ? std::round(x * 65536) : x);
}

}  // namespace

TEST_CASE_TEMPLATE(
    "a sphere meets nothing on its free way, ends where something is, and looks as "
    "often as it enters bricks",
    N, FixedNumbers, DoubleNumbers) {
  Dice dice(3);
  int whole = 0, none = 0, part = 0;
  for (int i = 0; i < cases(400); ++i) {
    std::vector<Density> density(kGrid.voxel_count(), 0);
    std::vector<Point> hot;
    for (int k = 0; k < i % 7 * 5; ++k) {
      const Point v{std::floor(dice.uniform(0, 50)), std::floor(dice.uniform(0, 40)),
                    std::floor(dice.uniform(0, 45))};
      density[kGrid.index(int(v[0]), int(v[1]), int(v[2]))] = 9;
      hot.push_back(v);
    }
    const FreeBrickMap map(kGrid, density, 9);
    for (int k = 0; k < 10; ++k) {
      // Inside, outside, across; along an axis, not at all and far.
      const Point from{dice.uniform(-20, 70), dice.uniform(-20, 60), dice.uniform(-20, 65)};
      Point move = (k == 0 ? 2000 : dice.uniform(1, 90)) * dice.direction();
      if (k == 1) move[0] = move[2] = 0;
      if (k == 2) move = {};
      const double radius = dice.uniform(0, 6), size = std::max(1.0, length(move));
      const FreeSpaceMap bricks = map.bricks();
      const FreePath<N> way(bricks, {number<N>(move[0]), number<N>(move[1]), number<N>(move[2])},
                            number<N>(size + 0.001));
      const PointNumber<N> start[3] = {number<N>(from[0]), number<N>(from[1]), number<N>(from[2])};
      constexpr std::int64_t kMost = 10000;
      std::int64_t left = kMost;
      const auto all = kWholeMove<N>;
      const auto end = way.free_up_to(start, free_steps_for(radius + 0.001), 0, all, left);
      const double share = double(end) / double(all);
      CHECK(share <= 1);
      const double enters = (std::abs(move[0]) + std::abs(move[1]) + std::abs(move[2])) / 2 + 4;
      CHECK(double(kMost - left) <= enters);
      for (int at = 0; at <= 100; ++at) {
        const double found = gap(hot, from + at / 100.0 * share * move, radius);
        if (end > 0 && found < 0) REQUIRE(found >= 0);
      }
      // It stops for a brick, which is a box of two voxels, in steps of a quarter; a voxel at the
      // border is not read beyond it.
      const Point stop = from + share * move;
      const auto inside = [&](std::size_t axis, int n) {
        return stop[axis] >= 0 && stop[axis] <= n;
      };
      if (share < 1 && inside(0, 50) && inside(1, 40) && inside(2, 45)) {
        CHECK(gap(hot, stop, radius) < std::sqrt(12.0) + std::sqrt(3.0) + 0.26);
      }
      ++(share >= 1 ? whole : share <= 0 ? none : part);
      if (end <= 0) continue;
      // The same in two parts, and without enough looks.
      std::int64_t few = 1, more = kMost;
      const auto half = way.free_up_to(start, free_steps_for(radius + 0.001), 0, end / 2, more);
      CHECK(half == end / 2);
      CHECK(way.free_up_to(start, free_steps_for(radius + 0.001), 0, end, few) <= end);
      CHECK(few == 0);
    }
  }
  CHECK(whole > cases(400));
  CHECK(none > cases(400) / 40);
  CHECK(part > cases(400) / 8);
  const FreeSpaceMap unknown;
  std::int64_t left = 5;
  const FreePath<N> way(unknown, {number<N>(1), number<N>(1), number<N>(1)}, number<N>(2));
  CHECK(way.free_up_to({number<N>(5), number<N>(5), number<N>(5)}, 1, 0, kWholeMove<N>, left) == 0);
}

TEST_CASE_TEMPLATE("from outside no way is free for a sphere that the map cannot tell", N,
                   FixedNumbers, DoubleNumbers) {
  std::vector<Density> density(kGrid.voxel_count(), 0);
  density[kGrid.index(25, 20, 22)] = 9;
  const FreeBrickMap map(kGrid, density, 9);
  const FreeSpaceMap bricks = map.bricks();
  const FreePath<N> way(bricks, {number<N>(0), number<N>(0), number<N>(-10)}, number<N>(10.001));
  // 70 voxels above the volume: 92 from where the voxel is read.
  const PointNumber<N> start[3] = {number<N>(25), number<N>(20), number<N>(115)};
  for (const double radius : {40.0, 63.0, 64.0, 90.0, 91.9, 92.1, 200.0}) {
    CAPTURE(radius);
    std::int64_t left = 100;
    const auto free = way.free_up_to(start, free_steps_for(radius), 0, kWholeMove<N>, left);
    const double voxels = 10 * double(free) / double(kWholeMove<N>);
    CHECK(voxels <= std::max(0.0, 92 - radius));
    if (radius < 60) CHECK(voxels == doctest::Approx(10));
  }
}
