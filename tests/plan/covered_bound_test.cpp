// SPDX-License-Identifier: Apache-2.0
// How much a tool is said to cover, against what it does.
#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <span>
#include <vector>

#include <doctest/doctest.h>

#include "controller/kernel/covered_voxels.hpp"
#include "controller/kernel/overlap.hpp"
#include "controller/kernel/overlap_methods.hpp"
#include "controller/plan/method/tool_bounds.hpp"
#include "controller/plan/tables/sample_tables.hpp"
#include "tests/plan/costs_support.hpp"

using namespace kerf;
using namespace kerf::test;

TEST_CASE("a tool covers no more voxels than it is said to, in any pose and any volume") {
  std::srand(5);
  SceneVolume block = full_block(64);
  block.image.spacing_mm = {kVoxelMm, 1.5 * kVoxelMm, kVoxelMm};
  for (const SceneTool& tool : {ball(16), shape("cylinder", 0.5, 4), shape("cone", 0.6, 4),
                                shape("wheel", 1.5, 0.8), shape("flame", 0.6, 3)}) {
    CAPTURE(tool.name);
    std::vector<double> memory(std::size_t{50} * 50 * 50);
    std::size_t most = 0;
    for (int i = 0; i < 400; ++i) {
      ToolPose<DoubleNumbers> pose;
      pose.centre_vox = {32 + i % 7 * 0.13, 32 + i % 11 * 0.09, 32};
      pose.step = random_turn();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (double& step : pose.step[axis]) step *= kVoxelMm / block.image.spacing_mm[axis];
      }
      OverlapBox<DoubleNumbers> box{memory, {}, 0};
      static_cast<void>(overlap<DoubleNumbers>(block.image.grid, tool.offsets, pose, 1, box));
      const auto used = std::span(memory).first(
          VoxelGrid{box.box.extent().x, box.box.extent().y, box.box.extent().z}.voxel_count());
      most = std::max(
          most, used.size() - static_cast<std::size_t>(std::count(used.begin(), used.end(), 0.0)));
    }
    SceneTool turned = tool;
    turned.round = false;
    CHECK(most <= max_covered_voxels(turned, block));
    CHECK(most > max_covered_voxels(turned, block) / 5);  // the cone fills a third of its cylinder
  }
}

TEST_CASE("a tool covers no more groups than it is said to, in any pose") {
  std::srand(6);
  SceneVolume block = full_block(64);
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
      ToolPose<FixedNumbers> pose;
      pose.centre_vox = {Q16(32 + i % 7 * 0.13), Q16(32 + i % 11 * 0.09), Q16(32)};
      const Matrix turn = random_turn();
      for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < 3; ++b) pose.step[a][b] = step_of<FixedNumbers>(turn[a][b]);
      }
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
