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
#include "tests/kernel/hash.hpp"

using namespace kerf;
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
  overlap<FixedNumbers>(volume.grid, rig.tool, pose, volume_ratio, scratch);
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
    Cutter<FixedNumbers> cutter(tool.width + 2);
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
        const auto pose = turned_pose<FixedNumbers>(
            {within(-out, grid.nx + out), within(-out, grid.ny + out), within(-out, grid.nz + out)},
            {within(-1, 1), within(-1, 1), within(-1, 1), i % 5 == 0 ? 0.0 : within(-1, 1)},
            tool.pitch);
        const std::int32_t volume_ratio =
            i % 2 == 0 ? FixedNumbers::kStepOne
                       : step_from<FixedNumbers>(tool.pitch * tool.pitch * tool.pitch);
        const auto rate = removal_rate<FixedNumbers>(within(0, 1.3), i % 7 == 0);
        std::vector<std::uint16_t> carry(tool.width + 36);
        for (auto& owed : carry) owed = static_cast<std::uint16_t>(random());
        const AlignedOutcome truth =
            by_definition(rig, volume, field, pose, volume_ratio, rate, carry, cutter.overlap);
        felt += truth.contact == SumVec<FixedNumbers>{} ? 0 : 1;
        cut_away += truth.removed.density_steps != 0 ? 1 : 0;
        for (auto set = kernel_sets(); *set != nullptr; ++set) {
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
    const auto pose = pose_at<FixedNumbers>({x, 11.3, 9.8});
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

TEST_CASE("a scripted turn through noise ends in the known hash on every instruction set") {
  SplatRig rig(box_tool(7, 4, 9), 17);
  const auto rate = removal_rate<FixedNumbers>(0.125, true);
  for (auto set = kernel_sets(); *set != nullptr; ++set) {
    std::uint32_t noise = 1;
    TestVolume volume = made_of({60, 26, 24}, [&](auto, auto, std::int32_t z) {
      noise = noise * 1664525u + 1013904223u;
      return static_cast<Density>(z < 14 ? 60000 + (noise >> 20) : noise >> 26);
    });
    std::vector<std::uint16_t> carry(64);
    Hash hash;
    for (int tick = 0; tick < 120; ++tick) {
      // Rational quaternions and positions: no libm decides about a bit.
      const auto pose = turned_pose<FixedNumbers>(
          {tick * 0.5625 - 6, 12 + tick * 0.03125, 15 - tick * 0.0625}, {1, 2, tick * 0.125, 3});
      AlignedOutcome out =
          rig.run(**set, kExactFarid, volume, pose, FixedNumbers::kStepOne, rate, carry);
      hash.add(out.contact);
      hash.add(out.modification);
      hash.add(out.removed.density_steps);
      volume.density = std::move(out.density);
      carry = std::move(out.carry);
    }
    for (const Density rho : volume.density) hash.add(std::uint64_t{rho});
    CAPTURE(std::string((*set)->name));
    CHECK(hash.hex() == "a69d2e952cf7447e");
  }
}

TEST_CASE("splatting far outside, or with too few lanes to carry, does nothing") {
  SplatRig rig(box_tool(3, 3, 3), 8);
  const TestVolume volume = filled({20, 20, 20}, 65535);
  const auto rate = removal_rate<FixedNumbers>(1.0, false);
  constexpr std::int32_t kFar = 0x7fffffff;
  const auto at = [](std::int32_t x, std::int32_t y, std::int32_t z) {
    auto pose = pose_at<FixedNumbers>({0, 0, 0});
    pose.centre_vox = {Q16::from_raw(x), Q16::from_raw(y), Q16::from_raw(z)};
    return pose;
  };
  for (auto set = kernel_sets(); *set != nullptr; ++set) {
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
  for (auto set = kernel_sets(); *set != nullptr; ++set) {
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
