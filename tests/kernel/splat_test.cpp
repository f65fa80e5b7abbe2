// SPDX-License-Identifier: Apache-2.0
// The method `splat`: every instruction set against its definition, bit for bit.
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
#include "tests/kernel/definitions.hpp"
#include "tests/support/sets_to_run.hpp"

namespace kerf::splat_test {

using namespace kerf::test;

namespace {

/// One tool with the memory to run it on any instruction set.
struct SplatRig {
  SplatRig(std::vector<ToolOffset> offsets, std::size_t width_vox)
      : tool(std::move(offsets)), samples(tool, SampleOrder::scattered) {
    memory.hold({width_vox, width_vox, width_vox}, tool.size());
  }
  AlignedOutcome run(const KernelSet& kernels, const ExactTaps& taps, const TestVolume& volume,
                     const ToolPose<FixedNumbers>& pose, std::int32_t volume_ratio,
                     const RemovalRate<FixedNumbers>& rate,
                     const std::vector<std::uint16_t>& carry) {
    AlignedOutcome out{{}, {}, {}, volume.density, carry};
    const SplatOutcome tick = splat_tick(kernels, samples.table(), taps, memory.view(), volume.grid,
                                         out.density, pose, volume_ratio, rate, out.carry);
    out.contact = tick.felt.contact;
    out.modification = tick.felt.modification;
    out.removed = tick.removed;
    return out;
  }

  std::vector<ToolOffset> tool;
  SampleTool samples;
  SplatMemory memory;
};

AlignedOutcome by_definition(const SplatRig& rig, const TestVolume& volume, const ExactField& field,
                             const ToolPose<FixedNumbers>& pose, std::int32_t volume_ratio,
                             const RemovalRate<FixedNumbers>& rate,
                             const std::vector<std::uint16_t>& carry,
                             OverlapBox<FixedNumbers>& scratch) {
  AlignedOutcome out{{}, {}, {}, volume.density, carry};
  out.contact = splat_contact_sum(field, rig.tool, pose);
  overlap(volume.grid, rig.tool, pose, volume_ratio, scratch);
  out.modification =
      exact_modification_sum(field, volume.grid, volume.density, scratch, rig.tool.size());
  out.removed = remove<FixedNumbers>(volume.grid, out.density, scratch, rate, out.carry);
  return out;
}

}  // namespace

TEST_CASE("splatting gives the bits of the definition for any tool in any pose") {
  struct Named {
    std::vector<ToolOffset> offsets;
    double pitch;
    std::size_t width;
    int cases;  ///< per fill of the volume, of which there are 12: 10^5 in all
  };
  const std::array<Named, 7> tools{{{box_tool(1, 1, 1), 1, 6, 5'000},
                                    {box_tool(3, 2, 1), 1, 9, 2'700},
                                    {ragged_tool(5, 4, 6, 2), 0.7, 11, 500},
                                    {box_tool(3, 3, 3), 3.1, 21, 100},
                                    {box_tool(8, 8, 8), 0.13, 6, 60},
                                    {box_tool(12, 3, 12), 1, 22, 30},
                                    {box_tool(28, 27, 28), 0.7, 38, 2}}};
  std::mt19937 random(5);
  const auto within = [&](double from, double to) {
    return from + (to - from) * (static_cast<double>(random()) / 4294967296.0);
  };
  for (const Named& tool : tools) {
    SplatRig rig(tool.offsets, tool.width);
    Cutter<> cutter(tool.width + 2);
    int felt = 0, cut_away = 0;
    for (int fill = 0; fill < kFills; ++fill) {
      // Rows longer than the widest vector, then a volume smaller than the tool.
      const VoxelGrid grid = fill % 4 == 3 ? VoxelGrid{7, 9, 8} : VoxelGrid{44, 14, 12};
      const TestVolume volume = hard_volume(grid, fill, static_cast<std::uint32_t>(fill));
      const ExactTaps& taps = fill % 3 == 0   ? kExactSobel5
                              : fill % 5 == 1 ? kExactCentral
                                              : kExactFarid;
      const ExactField field(taps, volume);
      for (int i = 0; i < cases(tool.cases); ++i) {
        const double out = i % 3 == 0 ? 5 : -2;
        const auto pose = turned_pose(
            {within(-out, grid.nx + out), within(-out, grid.ny + out), within(-out, grid.nz + out)},
            {within(-1, 1), within(-1, 1), within(-1, 1), i % 5 == 0 ? 0.0 : within(-1, 1)},
            tool.pitch);
        const std::int32_t volume_ratio =
            i % 2 == 0 ? FixedNumbers::kStepOne : step_from(tool.pitch * tool.pitch * tool.pitch);
        const auto rate = removal_rate<FixedNumbers>(within(0, 1.3), i % 7 == 0);
        std::vector<std::uint16_t> carry(tool.width + 36);
        for (auto& owed : carry) owed = static_cast<std::uint16_t>(random());
        const AlignedOutcome truth =
            by_definition(rig, volume, field, pose, volume_ratio, rate, carry, cutter.overlap);
        felt += truth.contact == SumVec<FixedNumbers>{} ? 0 : 1;
        cut_away += truth.removed.density_steps != 0 ? 1 : 0;
        for (auto set = sets_to_run(); *set != nullptr; ++set) {
          const bool same = rig.run(**set, taps, volume, pose, volume_ratio, rate, carry) == truth;
          if (!same) {
            INFO(tool.offsets.size(), " samples, ", std::string((*set)->name), ", fill ", fill,
                 ", case ", i);
            REQUIRE(same);
          }
        }
      }
    }
    if (cases(tool.cases) < 10) continue;  // too few to meet everything
    CHECK(felt > 3 * cases(tool.cases));
    CHECK(cut_away > 2 * cases(tool.cases));
  }
}

TEST_CASE("an unturned tool of the voxels' pitch cuts the same by splatting and aligned") {
  const auto offsets = paper_ball(10);
  SplatRig rig(offsets, 14);
  const TestVolume volume = random_volume({50, 24, 22}, 3);
  const auto rate = removal_rate<FixedNumbers>(0.3, false);
  const std::vector<std::uint16_t> carry(64, 777);
  for (const double x : {-2.0, 12.25, 30.7, 47.9}) {
    const auto pose = pose_at({x, 11.3, 9.8});
    for (AlignedRig& aligned : rigs_for(offsets)) {
      const AlignedOutcome a = aligned.run(volume, pose, rate, carry);
      const AlignedOutcome b = rig.run(aligned.kernels(), kExactFarid, volume, pose,
                                       FixedNumbers::kStepOne, rate, carry);
      CHECK(a.modification == b.modification);
      CHECK(a.density == b.density);
      CHECK(a.carry == b.carry);
      CHECK(a.removed.changed == b.removed.changed);
      // Contact keeps 8 bits in one plan and everything in the other: one step each at most.
      const double felt = static_cast<double>(a.contact.x) / 256;
      const double exact = static_cast<double>(b.contact.x) * kExactFarid.factor /
                           (32768.0 * static_cast<double>(1 << kExactFarid.shift));
      CHECK(felt == doctest::Approx(exact).epsilon(1e-4).scale(552));
    }
  }
}

TEST_CASE("splatting far outside, or with too few lanes to carry, does nothing") {
  SplatRig rig(box_tool(3, 3, 3), 8);
  const TestVolume volume = filled({20, 20, 20}, 65535);
  const auto rate = removal_rate<FixedNumbers>(1.0, false);
  constexpr std::int32_t kFar = 0x7fffffff;
  const auto at = [](std::int32_t x, std::int32_t y, std::int32_t z) {
    auto pose = pose_at({0, 0, 0});
    pose.centre_vox = {Q16::from_raw(x), Q16::from_raw(y), Q16::from_raw(z)};
    return pose;
  };
  for (auto set = sets_to_run(); *set != nullptr; ++set) {
    const auto nothing = [&](const ToolPose<FixedNumbers>& pose, std::size_t lanes) {
      const std::vector<std::uint16_t> carry(lanes, 65535);
      const AlignedOutcome out =
          rig.run(**set, kExactFarid, volume, pose, FixedNumbers::kStepOne, rate, carry);
      return out.removed.density_steps == 0 && out.density == volume.density && out.carry == carry;
    };
    CHECK(nothing(at(kFar, 0, 0), 64));
    CHECK(nothing(at(0, -kFar - 1, 0), 64));
    CHECK(nothing(at(10 << 16, 10 << 16, kFar), 64));
    CHECK(nothing(at(200 << 16, 10 << 16, 10 << 16), 64));
    CHECK(nothing(at(10 << 16, 10 << 16, 10 << 16), 31));
    CHECK_FALSE(nothing(at(10 << 16, 10 << 16, 10 << 16), 32));
  }
}

TEST_CASE("what the tallest box loses is counted in full") {
  // More rows than a 32-bit sum of full losses holds.
  const TickBox box = tick_box({20, 139, 139}, kExactFarid, 1000);
  const VoxelGrid grid{80, 160, 160};
  BoxMemory memory;
  memory.hold(box.size, true);
  const BoxScratch scratch = memory.view();
  const std::int32_t rows = (box.size.y + 1) * (box.size.z + 1);
  for (auto set = sets_to_run(); *set != nullptr; ++set) {
    std::vector<Density> density(grid.voxel_count(), 65535);
    (*set)->copy_box(box, grid, density.data(), {4, 4, 4}, scratch);
    std::int16_t* ratio = scratch.ratio + kRatioRowPad;
    for (std::int32_t row = 0; row < rows; ++row, ratio += box.row_lanes + kRatioRowPad) {
      scratch.live[row] = 1;
      for (std::int32_t x = 0; x < box.row_lanes; ++x) {
        ratio[x] = x >= 2 && x <= box.size.x + 2 ? std::int16_t{-32768} : std::int16_t{0};
      }
    }
    std::vector<std::uint16_t> carry(static_cast<std::size_t>(box.row_lanes));
    const BoxCut cut =
        (*set)->cut(box, {32768, 0}, grid, density.data(), {4, 4, 4}, scratch, carry.data());
    CAPTURE(std::string((*set)->name));
    CHECK(cut.density_steps == std::uint64_t{65535} * 21 * static_cast<std::uint64_t>(rows));
  }
}

// Contact of the method `gather`: every instruction set against `contact_sum`, bit for bit.

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

/// Checks that every instruction set gives the same sum; returns in how many cases it is not zero.
int count_not_zero(const VoxelGrid& grid, const Field& field, std::span<const ToolOffset> tool,
                   const SampleTable& samples, const ToolPose<FixedNumbers>& pose) {
  const std::span<const Gradient<FixedNumbers>> voxels(field.data(), grid.voxel_count());
  const auto truth = contact_sum<FixedNumbers>(grid, voxels, tool, pose);
  for (auto set = sets_to_run(); *set != nullptr; ++set) {
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
          auto pose = turned_pose(
              {within(-out, grid.nx + out), within(-out, grid.ny + out),
               within(-out, grid.nz + out)},
              {within(-1, 1), within(-1, 1), within(-1, 1), i % 5 == 0 ? 0.0 : within(-1, 1)},
              tool.pitch);
          if (i % 4 == 1) pose.centre_vox.x = Q16::from_raw(pose.centre_vox.x.raw() | 0xffff);
          if (i % 4 == 2) pose.centre_vox.y = Q16::from_raw(pose.centre_vox.y.raw() & ~0xffff);
          felt += count_not_zero(grid, field, tool.offsets, samples.table(), pose);
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
    // Within cells, and on voxels: there one lane of AVX2 has the whole weight of each sample.
    for (const auto& pose :
         {pose_at({35.3, 34.9, 22.6}), pose_at({35, 35, 23}), pose_at({35.5, 35.5, 23.5})}) {
      CHECK(count_not_zero(grid, field, tool, samples.table(), pose) == 1);
    }
  }
}

TEST_CASE("a volume without a single cell is not felt, and a place beyond all volumes neither") {
  const auto tool = box_tool(2, 2, 2);
  const SampleTool samples(tool, SampleOrder::as_given);
  std::mt19937 random(1);
  for (const VoxelGrid grid : {VoxelGrid{1, 5, 5}, {5, 1, 5}, {5, 5, 1}}) {
    const Field field = hard_field(grid, 0, random);
    CHECK(count_not_zero(grid, field, tool, samples.table(), pose_at({0.5, 2, 2})) == 0);
  }
  const VoxelGrid grid{5, 5, 5};
  const Field field = hard_field(grid, 0, random);
  constexpr std::int32_t kFar = 0x7fffffff;
  for (const auto& at : {std::array{kFar, 0, 0}, {0, -kFar - 1, 0}, {2 << 16, 2 << 16, kFar}}) {
    auto pose = pose_at({0, 0, 0});
    pose.centre_vox = {Q16::from_raw(at[0]), Q16::from_raw(at[1]), Q16::from_raw(at[2])};
    CHECK(count_not_zero(grid, field, tool, samples.table(), pose) == 0);
  }
}

}  // namespace kerf::splat_test
