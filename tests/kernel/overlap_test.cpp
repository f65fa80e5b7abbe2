// SPDX-License-Identifier: Apache-2.0
#include "controller/kernel/overlap.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include <doctest/doctest.h>

#include "tests/kernel/support.hpp"
#include "tests/support/property.hpp"
#include "tests/support/voxels.hpp"

namespace kerf::overlap_test {

using namespace kerf::test;

namespace {

/// min(1, ratio * SUM of hat weights) of one voxel, straight from the formula.
double obvious_ratio(std::span<const ToolOffset> tool, const ToolPose<DoubleNumbers>& pose,
                     double volume_ratio, VoxelIndex v) {
  double sum = 0;
  for (const ToolOffset& offset : tool) {
    const auto at = sample_position(pose, offset);
    sum += std::max(0.0, 1 - std::abs(at.x - v.x)) * std::max(0.0, 1 - std::abs(at.y - v.y)) *
           std::max(0.0, 1 - std::abs(at.z - v.z));
  }
  return std::min(1.0, volume_ratio * sum);
}

template <class N>
double ratio_of(const OverlapBox<N>& box, VoxelIndex v) {
  const bool covered = v.x >= box.box.lo.x && v.y >= box.box.lo.y && v.z >= box.box.lo.z &&
                       v.x < box.box.hi.x && v.y < box.box.hi.y && v.z < box.box.hi.z;
  return covered ? double(box.memory[box.at(v)]) / double(N::kWeightOne) : 0.0;
}

}  // namespace

TEST_CASE("one tool voxel on a voxel covers it whole; half-way it covers both by half") {
  const VoxelGrid grid{9, 9, 9};
  const std::vector<ToolOffset> tool = {{0, 0, 0}};
  Cutter<> cutter(8);
  const auto on = overlap(grid, tool, pose_at({4, 4, 4}), FixedNumbers::kStepOne, cutter.overlap);
  CHECK(on == VoxelBox{{4, 4, 4}, {6, 6, 6}});
  CHECK(ratio_of(cutter.overlap, {4, 4, 4}) == 1.0);
  CHECK(ratio_of(cutter.overlap, {5, 4, 4}) == 0.0);
  overlap(grid, tool, pose_at({4.5, 4, 4}), FixedNumbers::kStepOne, cutter.overlap);
  CHECK(ratio_of(cutter.overlap, {4, 4, 4}) == 0.5);
  CHECK(ratio_of(cutter.overlap, {5, 4, 4}) == 0.5);
}

TEST_CASE("the inside of an unturned tool of the volume's pitch is covered whole at any offset") {
  CHECK(property([] {
    const auto x = any<std::uint16_t>();
    const auto y = any<std::uint16_t>();
    const auto z = any<std::uint16_t>();
    const VoxelGrid grid{40, 40, 40};
    ToolPose<FixedNumbers> pose = pose_at({20, 20, 20});
    pose.centre_vox =
        pose.centre_vox + VoxelVec<Q16>{Q16::from_raw(x), Q16::from_raw(y), Q16::from_raw(z)};
    const auto tool = paper_ball(10);
    Cutter<> cutter(16);
    overlap(grid, tool, pose, FixedNumbers::kStepOne, cutter.overlap);
    std::int64_t total = 0;
    for (const auto w : cutter.overlap.memory.first(11 * 11 * 11)) {
      HOLDS(w >= 0);
      HOLDS(w <= FixedNumbers::kWeightOne);
      total += w;
    }
    // Nothing is clipped, so every tool voxel's weight is there.
    HOLDS(total == std::int64_t{FixedNumbers::kWeightOne} * 552);
    HOLDS(ratio_of(cutter.overlap, {20, 20, 20}) == 1.0);
    HOLDS(ratio_of(cutter.overlap, {21, 21, 21}) == 1.0);
  }));
}

TEST_CASE_TEMPLATE("overlap is the clamped sum of trilinear weights, inside and across the border",
                   N, FixedNumbers, DoubleNumbers) {
  CHECK(property([] {
    const auto seed = any<std::uint32_t>();
    std::mt19937 random(seed);
    const auto within = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    const VoxelGrid grid{1 + static_cast<std::int32_t>(random() % 12),
                         1 + static_cast<std::int32_t>(random() % 10),
                         1 + static_cast<std::int32_t>(random() % 9)};
    const std::array<double, 3> centre{within(-4, 14), within(-4, 12), within(-4, 10)};
    const std::array<double, 4> q{within(-1, 1), within(-1, 1), within(-1, 1), 1.5};
    const double pitch = within(0.3, 1.4);
    const double volume_ratio = pitch * pitch * pitch;
    const auto tool = odd_ball(3);
    Cutter<N> cutter(24);
    const VoxelBox box = overlap<N>(grid, tool, turned_pose<N>(centre, q, pitch),
                                    step_from<N>(volume_ratio), cutter.overlap);
    HOLDS(box.empty() || box == cutter.overlap.box.clipped(grid.box()));
    const auto exact = turned_pose<DoubleNumbers>(centre, q, pitch);
    for (const auto& [x, y, z] : voxels(grid)) {
      const double expected = obvious_ratio(tool, exact, volume_ratio, {x, y, z});
      // Q15 weights of some 40 samples, poses of 2^-17, steps of 2^-21 on 6 half pitches.
      HOLDS(std::abs(ratio_of(cutter.overlap, {x, y, z}) - expected) < 2e-3);
    }
  }));
}

// N7
TEST_CASE("the order of the samples does not change a fixed overlap") {
  const VoxelGrid grid{30, 30, 30};
  auto tool = paper_ball(10);
  const auto pose = turned_pose({14.3, 15.2, 13.9}, {0.3, -0.2, 0.5, 0.8});
  Cutter<> first(24), other(24);
  overlap(grid, tool, pose, FixedNumbers::kStepOne, first.overlap);
  std::mt19937 random(7);
  bool same = true;
  for (int n = 0; n < 1000; ++n) {
    std::shuffle(tool.begin(), tool.end(), random);
    overlap(grid, tool, pose, FixedNumbers::kStepOne, other.overlap);
    same = same && other.overlap.box == first.overlap.box && other.memory == first.memory;
  }
  CHECK(same);
}

TEST_CASE("more samples in one voxel than a weight can count still cover it just whole") {
  const VoxelGrid grid{9, 9, 9};
  const std::vector<ToolOffset> crowd(70000, ToolOffset{});
  Cutter<> cutter(8);
  for (const std::int32_t volume_ratio : {FixedNumbers::kStepOne, 1 << 10, 1 << 30}) {
    overlap(grid, crowd, pose_at({4, 4, 4}), volume_ratio, cutter.overlap);
    CHECK(ratio_of(cutter.overlap, {4, 4, 4}) == 1.0);
    CHECK(ratio_of(cutter.overlap, {5, 4, 4}) == 0.0);
  }
}

TEST_CASE("the memory sized for a tool is enough in any orientation, at any pitch and spacing") {
  CHECK(property([] {
    const auto seed = any<std::uint32_t>();
    std::mt19937 random(seed);
    const auto within = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    const std::array<std::int32_t, 3> size = {1 + static_cast<std::int32_t>(random() % 9),
                                              1 + static_cast<std::int32_t>(random() % 9),
                                              1 + static_cast<std::int32_t>(random() % 20)};
    std::vector<ToolOffset> corners;
    for (unsigned c = 0; c < 8; ++c) {
      const auto end = [&](std::size_t axis) {
        return static_cast<std::int16_t>((c >> axis & 1u) != 0 ? size[axis] - 1 : 1 - size[axis]);
      };
      corners.push_back({end(0), end(1), end(2)});
    }
    const double pitch = within(0.05, 0.5);
    const std::array<double, 3> spacing{within(0.05, 0.5), within(0.05, 0.5), within(0.05, 0.5)};
    auto pose = turned_pose({200.0 + within(0, 1), 200.0 + within(0, 1), 200.5},
                            {within(-1, 1), within(-1, 1), within(-1, 1), 1.1});
    for (std::size_t a = 0; a < 3; ++a) {
      for (auto& step : pose.step[a]) {
        step = static_cast<std::int32_t>(std::lround(step * pitch / spacing[a]));
      }
    }
    std::vector<std::int32_t> memory(overlap_capacity({400, 400, 400}, size, pitch, spacing));
    OverlapBox<FixedNumbers> box{memory, {}, 0};
    HOLDS(!overlap({400, 400, 400}, corners, pose, FixedNumbers::kStepOne, box).empty());
    HOLDS(static_cast<std::size_t>(box.box.extent().x) <= overlap_width(size, pitch, spacing[0]));
  }));
}

TEST_CASE_TEMPLATE("the memory is enough in any volume, and no more than the volume and its rim", N,
                   FixedNumbers, DoubleNumbers) {
  CHECK(property([] {
    const auto seed = any<std::uint32_t>();
    std::mt19937 random(seed);
    const auto within = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    const auto voxels = [&] {
      return 1 + static_cast<std::int32_t>(random() % (random() % 2 == 0 ? 4 : 30));
    };
    const VoxelGrid grid{voxels(), voxels(), voxels()};
    const std::array<double, 3> spacing{within(1, 3), within(1, 3), within(1, 3)};
    const auto tool = paper_ball(11);
    auto pose =
        turned_pose<N>({within(-3, grid.nx + 3), within(-3, grid.ny + 3), within(-3, grid.nz + 3)},
                       {within(-1, 1), within(-1, 1), within(-1, 1), 1.1});
    for (std::size_t a = 0; a < 3; ++a) {
      for (auto& step : pose.step[a]) {
        step = static_cast<typename N::Step>(static_cast<double>(step) / spacing[a]);
      }
    }
    std::vector<typename N::Weight> memory(overlap_capacity(grid, {11, 11, 11}, 1, spacing));
    HOLDS(memory.size() <= VoxelGrid{grid.nx + 2, grid.ny + 2, grid.nz + 2}.voxel_count());
    OverlapBox<N> box{memory, {}, 0};
    const bool touches = std::ranges::any_of(tool, [&](const ToolOffset& offset) {
      return cell_at<N>(sample_position(pose, offset)).touches(grid);
    });
    static_cast<void>(overlap(grid, tool, pose, N::kStepOne, box));
    HOLDS(box.box.empty() != touches);
  }));
  const VoxelGrid inside_tool{3, 4, 5};
  std::vector<typename N::Weight> memory(overlap_capacity(inside_tool, {11, 11, 11}, 1, {1, 1, 1}));
  OverlapBox<N> box{memory, {}, 0};
  overlap(inside_tool, paper_ball(11), pose_at<N>({1.3, 1.8, 2.4}), N::kStepOne, box);
  CHECK(box.box == VoxelBox{{-1, -1, -1}, {4, 5, 6}});
  CHECK(memory.size() == 5 * 6 * 7);  // the bound is reached
}

TEST_CASE("a box too large for its memory, a far tool and an empty one cover nothing") {
  const VoxelGrid grid{30, 30, 30};
  const auto tool = paper_ball(10);
  std::vector<std::int32_t> memory(11 * 11 * 11 - 1);
  OverlapBox<FixedNumbers> box{memory, {}, 0};
  const auto covers = [&](std::array<double, 3> centre) {
    return !overlap(grid, tool, pose_at(centre), FixedNumbers::kStepOne, box).empty();
  };
  CHECK_FALSE(covers({15.3, 15.3, 15.3}));
  CHECK(box.box.empty());
  CHECK(covers({1, 15.3, 15.3}));
  for (const double far : {-30.0, 60.0, 1e9, -1e9}) CHECK_FALSE(covers({15, far, 15}));
  CHECK(box.box.empty());
  CHECK(overlap(grid, {}, pose_at({15, 15, 15}), FixedNumbers::kStepOne, box).empty());
}

}  // namespace kerf::overlap_test
