// SPDX-License-Identifier: Apache-2.0
// Contact of the method `gather`: every instruction set against `contact_sum`, bit for bit.
#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/kernel/overlap_methods.hpp"
#include "controller/plan/tables/sample_tables.hpp"
#include "tests/case_count.hpp"
#include "tests/kernel/aligned_support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

using Field = std::vector<Gradient<FixedNumbers>>;

/// Gradients of any kind, up to the ends of what a kernel may store.
Field hard_field(const VoxelGrid& grid, int kind, std::mt19937& random) {
  Field field(grid.voxel_count() + kFieldPad);
  const auto value = [&](std::int16_t end) -> std::int16_t {
    switch (kind) {
      case 0:
        return end;
      case 1:
        return static_cast<std::int16_t>(-end);
      case 2:
        return (random() & 1) != 0 ? end : static_cast<std::int16_t>(-end);
      case 3:
        return static_cast<std::int16_t>(static_cast<std::int32_t>(random() % 65535) - 32767);
      default:
        return random() % 17 == 0 ? end : std::int16_t{0};
    }
  };
  for (auto& g : field) g = {value(32767), value(25482), value(32767)};
  return field;
}

/// Equal on every instruction set? Tells how many of the cases felt anything.
int felt_alike(const VoxelGrid& grid, const Field& field, std::span<const ToolOffset> tool,
               const SampleTable& samples, const ToolPose<FixedNumbers>& pose) {
  const std::span<const Gradient<FixedNumbers>> voxels(field.data(), grid.voxel_count());
  const auto truth = contact_sum<FixedNumbers>(grid, voxels, tool, pose);
  for (auto set = kernel_sets(); *set != nullptr; ++set) {
    const bool same = gathered_contact(**set, samples, grid, voxels, pose) == truth;
    if (!same) {
      INFO(std::string((*set)->name), ", ", tool.size(), " samples");
      REQUIRE(same);
    }
  }
  return truth == SumVec<FixedNumbers>{} ? 0 : 1;
}

}  // namespace

TEST_CASE("gathering gives the bits of the plain loop for any tool in any pose") {
  struct Named {
    std::vector<ToolOffset> offsets;
    double pitch;
    int cases;  ///< per field: 10^5 in all
  };
  const std::array<Named, 6> tools{{{box_tool(1, 1, 1), 1, 10'000},
                                    {box_tool(3, 5, 1), 1, 8'000},
                                    {ragged_tool(5, 4, 6, 1), 0.7, 5'000},
                                    {box_tool(4, 4, 4), 6.1, 1'500},
                                    {paper_ball(8), 0.25, 450},
                                    {box_tool(16, 16, 16), 1, 50}}};
  std::mt19937 random(11);
  const auto within = [&](double from, double to) {
    return from + (to - from) * (static_cast<double>(random()) / 4294967296.0);
  };
  for (const Named& tool : tools) {
    int felt = 0;
    for (const VoxelGrid grid : {VoxelGrid{33, 20, 18}, {2, 2, 2}, {9, 40, 3}, {40, 5, 24}}) {
      for (int kind = 0; kind < 5; kind += grid.nx == 33 ? 1 : 4) {
        const Field field = hard_field(grid, kind, random);
        const SampleTool samples(tool.offsets,
                                 kind % 2 == 0 ? SampleOrder::as_given : SampleOrder::scattered);
        for (int i = 0; i < cases(tool.cases / 2); ++i) {
          const double out = i % 3 == 0 ? 6 : -1;  // across the border, or inside
          auto pose = turned_pose<FixedNumbers>(
              {within(-out, grid.nx + out), within(-out, grid.ny + out),
               within(-out, grid.nz + out)},
              {within(-1, 1), within(-1, 1), within(-1, 1), i % 5 == 0 ? 0.0 : within(-1, 1)},
              tool.pitch);
          if (i % 4 == 1) pose.centre_vox.x = Q16::from_raw(pose.centre_vox.x.raw() | 0xffff);
          if (i % 4 == 2) pose.centre_vox.y = Q16::from_raw(pose.centre_vox.y.raw() & ~0xffff);
          felt += felt_alike(grid, field, tool.offsets, samples.table(), pose);
        }
      }
    }
    CHECK(felt > cases(tool.cases / 2));
  }
}

TEST_CASE("a sum of more samples than 32 bits can hold is widened in time") {
  const auto tool = box_tool(64, 64, 40);  // 163 840 samples, all at the largest gradient
  const VoxelGrid grid{70, 70, 46};
  std::mt19937 random(1);
  const SampleTool samples(tool, SampleOrder::as_given);
  for (const int kind : {0, 1}) {
    const Field field = hard_field(grid, kind, random);
    CHECK(felt_alike(grid, field, tool, samples.table(),
                     pose_at<FixedNumbers>({35.3, 34.9, 22.6})) == 1);
  }
}

TEST_CASE("a volume without a single cell is not felt, and a place beyond all volumes neither") {
  const auto tool = box_tool(2, 2, 2);
  const SampleTool samples(tool, SampleOrder::as_given);
  std::mt19937 random(1);
  for (const VoxelGrid grid : {VoxelGrid{1, 5, 5}, {5, 1, 5}, {5, 5, 1}}) {
    const Field field = hard_field(grid, 0, random);
    CHECK(felt_alike(grid, field, tool, samples.table(), pose_at<FixedNumbers>({0.5, 2, 2})) == 0);
  }
  const VoxelGrid grid{5, 5, 5};
  const Field field = hard_field(grid, 0, random);
  constexpr std::int32_t kFar = 0x7fffffff;
  for (const auto& at : {std::array{kFar, 0, 0}, {0, -kFar - 1, 0}, {2 << 16, 2 << 16, kFar}}) {
    auto pose = pose_at<FixedNumbers>({0, 0, 0});
    pose.centre_vox = {Q16::from_raw(at[0]), Q16::from_raw(at[1]), Q16::from_raw(at[2])};
    CHECK(felt_alike(grid, field, tool, samples.table(), pose) == 0);
  }
}
