// SPDX-License-Identifier: Apache-2.0
// How much a tool is said to cover, against what it does.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <span>
#include <vector>

#include <doctest/doctest.h>

#include "controller/kernel/covered_voxels.hpp"
#include "controller/kernel/overlap.hpp"
#include "controller/kernel/overlap_methods.hpp"
#include "controller/plan/air_speed.hpp"
#include "controller/plan/compile.hpp"
#include "controller/plan/method/tool_bounds.hpp"
#include "controller/plan/tables/free_brick_map.hpp"
#include "controller/plan/tables/sample_tables.hpp"
#include "tests/plan/costs_support.hpp"
#include "tests/support/voxels.hpp"

namespace kerf::bounds_test {

using namespace kerf::test;

TEST_CASE("a tool covers no more voxels than it is said to, in any pose and any volume") {
  std::srand(5);
  for (const int edge : {64, 6}) {  // wider than the tools, and narrower
    SceneVolume block = full_block(edge);
    block.image.spacing_mm = {kVoxelMm, 1.5 * kVoxelMm, kVoxelMm};
    for (const SceneTool& tool : {ball(16), shape("cylinder", 0.5, 4), shape("cone", 0.6, 4),
                                  shape("wheel", 1.5, 0.8), shape("flame", 0.6, 3)}) {
      CAPTURE(tool.name);
      std::vector<double> memory(std::size_t{50} * 50 * 50);
      std::size_t most = 0;
      for (int i = 0; i < 400; ++i) {
        ToolPose<DoubleNumbers> pose = turned_in_block(edge, i);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          for (double& step : pose.step[axis]) step *= kVoxelMm / block.image.spacing_mm[axis];
        }
        OverlapBox<DoubleNumbers> box{memory, {}, 0};
        const VoxelBox inside =
            overlap<DoubleNumbers>(block.image.grid, tool.offsets, pose, 1, box);
        std::size_t covered = 0;
        for_each_voxel(inside, [&](int x, int y, int z) {
          covered += memory[box.at({x, y, z})] > 0 ? 1 : 0;
        });
        most = std::max(most, covered);
      }
      SceneTool turned = tool;
      turned.round = false;
      CHECK(most <= max_covered_voxels(turned, block));
      CHECK(most >
            max_covered_voxels(turned, block) / 5);  // the cone fills a third of its cylinder
    }
  }
}

TEST_CASE("a tool covers no more groups than it is said to, in any pose") {
  std::srand(6);
  for (const int edge : {64, 6}) {
    SceneVolume block = full_block(edge);
    for (const SceneTool& tool : {shape("cylinder", 0.5, 4), shape("cone", 0.6, 4),
                                  shape("wheel", 1.5, 0.8), shape("inverted_cone", 0.7, 1.4)}) {
      CAPTURE(tool.name);
      const SampleTool samples(tool.offsets, SampleOrder::scattered);
      SplatMemory memory;
      const std::size_t width = overlap_width(tool.size_vox, kVoxelMm, kVoxelMm);
      memory.hold({width, width, width}, tool.offsets.size());
      std::vector<CoveredGroup> list(10'000);
      std::size_t most = 0;
      for (int i = 0; i < 400; ++i) {
        const ToolPose<FixedNumbers> pose = rounded(turned_in_block(edge, i));
        const SplatTick tick(kScalarSet, samples.table(), kExactFarid, memory.view(),
                             block.image.grid, block.image.density, pose);
        tick.copy();
        tick.splat();
        tick.cover(FixedNumbers::kStepOne);
        most = std::max(
            most,
            covered_groups(kScalarSet, block.image.grid, {}, tick.overlap(), {}, list).list.size());
      }
      CHECK(most <= max_cover_groups(tool, block));
      CHECK(most > max_cover_groups(tool, block) / 5);
    }
  }
}

TEST_CASE("of a tool on the lattice the covered groups are counted") {
  SceneVolume block = full_block(64);
  std::vector<CoveredGroup> list(10'000);
  for (const int size : {1, 2, 15, 16, 17, 40}) {
    CAPTURE(size);
    const SceneTool tool = ball(size);
    const AlignedTool aligned(tool.offsets, kExactFarid, kScalarSet);
    BoxMemory memory;
    memory.hold(aligned.table().size, true);
    ToolPose<FixedNumbers> pose;
    pose.centre_vox = {Q16(31.3), Q16(31.4), Q16(31.7)};
    const AlignedTick tick(kScalarSet, aligned.table(), memory.view(), block.image.grid,
                           block.image.density, pose);
    tick.cover();
    const auto covered = covered_groups(kScalarSet, block.image.grid, {}, tick.overlap(), {}, list);
    CHECK(covered.list.size() == max_cover_groups(aligned.table()));
    CHECK(covered.list.size() <= max_cover_groups(tool, block));
  }
}

namespace {

std::vector<double> speeds(const LoadedScene& scene) {
  return plan_scene(scene)->costs().air_speeds_mm_per_s;
}

}  // namespace

TEST_CASE("how fast a hand may go in air is told for each tool, by rate, voxel and scale") {
  LoadedScene scene = half_space_scene(16);
  scene.force.model = ForceModel::proxy;
  scene.servo.numeric = NumericKind::fixed;
  scene.tools = {ball(8), shape("cylinder", 0.5, 2)};
  const auto usual = speeds(scene);
  REQUIRE(usual.size() == 2);
  for (const double speed : usual) {
    // At least 8 queries a tick, at most 31.
    CHECK(speed > 8 * 0.875 * kVoxelMm * scene.servo.rate_hz);
    CHECK(speed <= 31 * 0.875 * kVoxelMm * scene.servo.rate_hz);
  }
  scene.device.workspace_scale = 0.5;
  CHECK(speeds(scene)[0] == doctest::Approx(2 * usual[0]));
  scene.servo.rate_hz /= 4;
  CHECK(speeds(scene)[0] == doctest::Approx(usual[0] / 2));
  scene.servo.numeric = NumericKind::float64;
  CHECK(speeds(scene)[0] == doctest::Approx(usual[0] / 2));
  scene.force.model = ForceModel::paper;
  CHECK(speeds(scene).empty());
}

namespace {

/// Voxels between what brick b holds, 2b to 2b + 2, and where voxel v is read, v - 1 to v + 1.
double between(int brick, int voxel) {
  return std::max({0, voxel - 1 - (2 * brick + 2), 2 * brick - (voxel + 1)});
}

int steps_between(const VoxelIndex& brick, const VoxelIndex& voxel) {
  const double distance =
      std::hypot(between(brick.x, voxel.x), between(brick.y, voxel.y), between(brick.z, voxel.z));
  return std::min(254, static_cast<int>(4 * distance + 1e-9));
}

}  // namespace

TEST_CASE("bricks tell how far the nearest voxel with density is read") {
  std::mt19937 random(4);
  // No whole number of bricks, farther than the map can say, hardly a volume, and one where
  // something is near everywhere.
  for (const VoxelGrid grid : {VoxelGrid{45, 22, 31}, {161, 7, 90}, {1, 2, 3}, {9, 10, 8}}) {
    for (const int dense : {0, 1, 3, 20, grid.voxel_count() < 1000 ? 90 : 2}) {
      std::vector<Density> density(grid.voxel_count(), 99);
      std::vector<VoxelIndex> solid;
      const auto any = [&](std::int32_t n) {
        return static_cast<std::int32_t>(random() % static_cast<unsigned>(n));
      };
      for (int i = 0; i < dense; ++i) {
        const VoxelIndex at{any(grid.nx), any(grid.ny), any(grid.nz)};
        density[grid.index(at.x, at.y, at.z)] = 100;
        solid.push_back(at);
      }
      const FreeBrickMap map(grid, density, 100);
      const FreeSpaceMap bricks = map.bricks();
      CHECK(map.bytes() == bricks.grid.voxel_count());
      for (const auto& [x, y, z] : voxels(grid)) {
        int nearest = 254;
        for (const VoxelIndex& s : solid) {
          nearest = std::min(nearest, steps_between({x / 2, y / 2, z / 2}, s));
        }
        if (bricks.at(x, y, z) != nearest) REQUIRE(bricks.at(x, y, z) == nearest);
      }
      // Outside: that of the nearest brick inside, or the way to where something may be read.
      CHECK(bricks.at(-1, 1, 1) == bricks.at(0, 1, 1));
      CHECK(bricks.at(-6, 1, 1) == std::max(bricks.at(0, 1, 1), 5 * kFreeSteps));
      CHECK(bricks.at(-100, 1, 1000) == kFreeFarthest);
    }
  }
  CHECK(FreeSpaceMap{}.at(1, 2, 3) == 0);
}

TEST_CASE("a volume is free where nothing is read, or nothing near a voxel of the iso") {
  std::mt19937 random(8);
  constexpr VoxelGrid kGrid{39, 20, 26};
  constexpr Density kIso = 800;
  int soft_alone = 0;
  for (const int solid : {0, 1, 3}) {
    std::vector<Density> density(kGrid.voxel_count(), 0);
    const auto any = [&] { return static_cast<std::size_t>(random()) % density.size(); };
    for (int i = 0; i < 40; ++i) density[any()] = static_cast<Density>(99 + random() % 700);
    for (int i = 0; i < solid; ++i) density[any()] = kIso;
    const MappedField mapped(kGrid, density, kIso);
    const DensityField field = mapped.field();
    const FreeBrickMap felt(kGrid, density, kIso / 8), bearing(kGrid, density, kIso);
    for (const auto& [x, y, z] : voxels(kGrid)) {
      const std::int32_t unread = felt.bricks().at(x, y, z);
      const std::int32_t free = std::max(unread, bearing.bricks().at(x, y, z) - kIsoNearSteps);
      if (field.free.at(x, y, z) != free) REQUIRE(field.free.at(x, y, z) == free);
      soft_alone += free > unread ? 1 : 0;
    }
  }
  CHECK(soft_alone > 0);
}

TEST_CASE("a sphere needs the steps of its radius, and more than there are where it is too large") {
  CHECK(free_steps_for(0.5) == 2);
  CHECK(free_steps_for(0.51) == 3);
  CHECK(free_steps_for(3.5) == 14);
  CHECK(free_steps_for(63.5) == 254);
  CHECK(free_steps_for(63.6) == 255);
  CHECK(free_steps_for(1000) == 255);
}

}  // namespace kerf::bounds_test
