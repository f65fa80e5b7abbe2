// SPDX-License-Identifier: Apache-2.0
// Every instruction set against the definitions of the plan `aligned`, bit for bit.
#include <array>
#include <cstdlib>
#include <random>
#include <string>
#include <utility>

#include <doctest/doctest.h>

#include "tests/kernel/aligned_support.hpp"
#include "tests/kernel/hash.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

/// KERF_CASES multiplies the number of random cases; 1 keeps the whole test at some seconds.
int cases(int usual) {
  const char* factor = std::getenv("KERF_CASES");
  return usual * (factor == nullptr ? 1 : std::max(1, std::atoi(factor)));
}

struct Named {
  const char* name;
  std::vector<ToolOffset> offsets;
  int cases;  ///< per fill of the volume
};

ToolPose<FixedNumbers> pose_of(std::array<std::int32_t, 3> raw) {
  ToolPose<FixedNumbers> pose = pose_at<FixedNumbers>({0, 0, 0});
  pose.centre_vox = {Q16::from_raw(raw[0]), Q16::from_raw(raw[1]), Q16::from_raw(raw[2])};
  return pose;
}

/// Inside, across each border, outside; on the lattice and as far off as can be.
ToolPose<FixedNumbers> random_pose(const VoxelGrid& grid, int tool_vox, int i,
                                   std::mt19937& random) {
  const std::array<std::int32_t, 3> edge{grid.nx, grid.ny, grid.nz};
  std::array<std::int32_t, 3> raw{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int reach = i % 3 == 0 ? tool_vox : -tool_vox / 2;  // every third may be half outside
    const int span = std::max(1, edge[axis] + 2 * reach);
    std::uniform_int_distribution<std::int32_t> place(-reach * 65536, (span - reach) * 65536);
    raw[axis] = place(random);
    if (i % 7 == 1) raw[axis] &= ~0x7fff;
    if (i % 11 == 2) raw[axis] |= 0xffff;
  }
  return pose_of(raw);
}

RemovalRate<FixedNumbers> random_rate(int i, std::mt19937& random) {
  RemovalRate<FixedNumbers> rate;
  if (i % 5 == 0) return removal_rate<FixedNumbers>(1.0, false);
  if (i % 5 == 1) return removal_rate<FixedNumbers>(0.001 * double(random() % 3000), true);
  rate.mantissa = 16385 + static_cast<std::int32_t>(random() % 16384);
  rate.exponent = static_cast<int>(random() % (i % 5 == 2 ? 33 : 6));
  return rate;
}

/// The halves that a kernel's table keeps of the low part, by box entry.
std::vector<std::int32_t> low_halves(std::span<const ToolOffset> offsets, std::size_t slope_axis,
                                     const AlignedTable& table) {
  const VoxelGrid box{table.box.x, table.box.y, table.box.z};
  std::vector<std::int32_t> sum(box.voxel_count());
  for (const ToolOffset& offset : offsets) {
    for (std::size_t i = 0; i < 125; ++i) {
      const std::array<std::size_t, 3> step{i % 5, i / 5 % 5, i / 25};
      std::int32_t tap = 1;
      std::array<std::int32_t, 3> at{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        tap *=
            axis == slope_axis ? kAlignedFarid.slope[step[axis]] : kAlignedFarid.smooth[step[axis]];
        at[axis] = (offset[axis] - table.low[axis]) / 2 + static_cast<std::int32_t>(step[axis]);
      }
      sum[box.index(at[0], at[1], at[2])] += tap;
    }
  }
  for (std::int32_t& s : sum) s -= ((s + 256) >> 9) * 512;
  return sum;
}

}  // namespace

TEST_CASE("every instruction set gives the bits of the definition, wherever the tool is") {
  const std::array<Named, 9> tools{{{"one voxel", box_tool(1, 1, 1), 200},
                                    {"cube of 3", box_tool(3, 3, 3), 200},
                                    {"box of 2 x 9 x 5", box_tool(2, 9, 5), 120},
                                    {"ragged 11 x 6 x 8", ragged_tool(11, 6, 8, 5), 120},
                                    {"ball of 10", paper_ball(10), 120},
                                    {"ball of 16", paper_ball(16), 100},
                                    {"cube of 16", box_tool(16, 16, 16), 40},
                                    {"ball of 27", paper_ball(27), 10},
                                    {"ragged 28 x 7 x 33", ragged_tool(28, 7, 33, 6), 20}}};
  for (const Named& tool : tools) {
    std::mt19937 random(7);
    std::array rigs_of{rigs_for(tool.offsets, kAlignedFarid),
                       rigs_for(tool.offsets, kAlignedSobel5)};
    const VoxelIndex size = rigs_of[0].front().table().size;
    const int widest = std::max({size.x, size.y, size.z});
    Cutter<FixedNumbers> cutter(static_cast<std::size_t>(widest + 1));
    int felt = 0, cut_away = 0;
    for (int fill = 0; fill < kFills; ++fill) {
      // Rows longer than tool + 32, so that whole vectors are written; then rows shorter than one.
      const VoxelGrid grid = fill % 4 == 3 ? VoxelGrid{size.x + 3, size.y + 9, size.z + 2}
                                           : VoxelGrid{size.x + 37, size.y + 8, size.z + 9};
      const TestVolume volume = hard_volume(grid, fill, static_cast<std::uint32_t>(fill));
      // The second gradient kernel on every third volume.
      std::vector<AlignedRig>& rigs = rigs_of[fill % 3 == 0 ? 1 : 0];
      const AlignedTaps& taps = rigs.front().table().taps;
      const ExactField field(taps, volume);
      for (int i = 0; i < cases(tool.cases); ++i) {
        const auto pose = random_pose(grid, widest, i, random);
        const auto rate = random_rate(i, random);
        std::vector<std::uint16_t> carry(static_cast<std::size_t>(rigs.front().table().row_lanes) +
                                         3);
        for (auto& owed : carry) owed = static_cast<std::uint16_t>(random());
        const AlignedOutcome truth = outcome_by_definition(taps, volume, field, tool.offsets, pose,
                                                           rate, carry, cutter.overlap);
        felt += truth.contact == SumVec<FixedNumbers>{} ? 0 : 1;
        cut_away += truth.removed.density_steps != 0 ? 1 : 0;
        for (AlignedRig& rig : rigs) {
          const bool same = rig.run(volume, pose, rate, carry) == truth;
          if (!same) {
            INFO(std::string(tool.name), ", ", std::string(rig.kernels().name), ", fill ", fill,
                 ", case ", i);
            REQUIRE(same);
          }
        }
      }
    }
    CAPTURE(std::string(tool.name));
    CHECK(felt > 5 * tool.cases);
    CHECK(cut_away > 3 * tool.cases);
  }
}

TEST_CASE("contact by the table equals the definition without any cache") {
  const TestVolume volume = random_volume({20, 17, 15}, 9);
  const auto tool = paper_ball(6);
  const auto exact = [&](VoxelIndex v) {
    return gradient_exact(kAlignedFarid, volume.grid, volume.density, v);
  };
  for (AlignedRig& rig : rigs_for(tool)) {
    for (const auto& at : {std::array{10.3, 8.7, 7.2}, {1.6, 8.1, 7.9}, {18.2, 15.9, 13.1}}) {
      const auto pose = pose_at<FixedNumbers>(at);
      CHECK(rig.run(volume, pose, {}, {}).contact ==
            aligned_contact_sum(kAlignedFarid, exact, tool, pose));
    }
  }
}

TEST_CASE("large tools feel the same on every instruction set") {
  for (const int size : {32, 64}) {
    const auto tool = paper_ball(size);
    std::vector<AlignedRig> rigs = rigs_for(tool);
    for (const int fill : {3, 4}) {
      const TestVolume volume = hard_volume({size + 12, size + 6, size + 5}, fill, 3);
      const ExactField field(kAlignedFarid, volume);
      std::mt19937 random(1);
      for (int i = 0; i < (size == 32 ? 20 : 4); ++i) {
        const auto pose = random_pose(volume.grid, size, i, random);
        const auto truth = aligned_contact_sum(kAlignedFarid, field, tool, pose);
        for (AlignedRig& rig : rigs) {
          const auto out = rig.run(volume, pose, {}, {});
          CHECK(out.contact == truth);
          CHECK(out.density == volume.density);
        }
      }
    }
  }
}

TEST_CASE("sums are widened before the worst volume overflows them, and without it they do") {
  const auto cube = box_tool(16, 16, 16);
  std::vector<AlignedRig> rigs = rigs_for(cube);
  int overflows = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto low = low_halves(cube, axis, rigs.front().table());
    const VoxelIndex box = rigs.front().table().box;
    for (const bool positive : {true, false}) {
      // The tool's box is the whole volume: density where the low halves have one sign.
      TestVolume volume = filled({box.x, box.y, box.z}, 0);
      for (std::size_t i = 0; i < low.size(); ++i) {
        volume.density[i] = (low[i] > 0) == positive ? 65535 : 0;
      }
      const ExactField field(kAlignedFarid, volume);
      const auto pose = pose_at<FixedNumbers>({9.5, 9.5, 9.5});
      const auto truth = aligned_contact_sum(kAlignedFarid, field, cube, pose);
      for (AlignedRig& rig : rigs) {
        CHECK(rig.run(volume, pose, {}, {}).contact == truth);
        AlignedTable endless = rig.table();
        endless.flush = 1 << 30;
        overflows += rig.run(volume, pose, {}, {}, endless).contact == truth ? 0 : 1;
      }
    }
  }
  if (rigs.size() > 1) CHECK(overflows > 0);  // the plain loops widen every chunk
}

TEST_CASE("the tables of a ball leave room in 32 bits for at least 127 chunks") {
  for (const int size : {10, 16, 32}) {
    for (const AlignedRig& rig : rigs_for(paper_ball(size))) {
      CHECK(rig.table().flush >= 127);
      CHECK(rig.table().flush <= 2 * 131);
    }
  }
}

TEST_CASE("far outside nothing is felt, cut or read") {
  const auto tool = paper_ball(10);
  const TestVolume volume = filled({20, 20, 20}, 65535);
  constexpr std::int32_t kFar = 0x7fffffff;
  for (AlignedRig& rig : rigs_for(tool)) {
    for (const auto& at : {std::array{kFar, 0, 0},
                           {0, -kFar - 1, 0},
                           {0, 0, kFar},
                           std::array{-kFar - 1, -kFar - 1, -kFar - 1},
                           {kFar, kFar, kFar}}) {
      const std::vector<std::uint16_t> carry(64, 65535);
      const auto out = rig.run(volume, pose_of(at), removal_rate<FixedNumbers>(1.0, false), carry);
      CHECK(out == AlignedOutcome{{}, {}, {}, volume.density, carry});
    }
  }
}

TEST_CASE("a scripted groove ends in the known hash on every instruction set") {
  const auto tool = paper_ball(12);
  const auto rate = removal_rate<FixedNumbers>(0.125, false);
  for (AlignedRig& rig : rigs_for(tool)) {
    std::uint32_t noise = 1;
    TestVolume volume = made_of({70, 26, 24}, [&](auto, auto, std::int32_t z) {
      noise = noise * 1664525u + 1013904223u;
      return static_cast<Density>(z < 14 ? 60000 + (noise >> 20) : noise >> 26);
    });
    std::vector<std::uint16_t> carry(static_cast<std::size_t>(rig.table().row_lanes));
    Hash hash;
    for (int tick = 0; tick < 150; ++tick) {  // in at one face, along, out at the other
      const auto pose =
          pose_at<FixedNumbers>({tick * 0.5625 - 6, 10 + tick * 0.03125, 16 - tick * 0.0625});
      AlignedOutcome out = rig.run(volume, pose, rate, carry);
      hash.add(out.contact);
      hash.add(out.modification);
      hash.add(out.removed.density_steps);
      volume.density = std::move(out.density);
      carry = std::move(out.carry);
    }
    for (const Density rho : volume.density) hash.add(std::uint64_t{rho});
    CAPTURE(std::string(rig.kernels().name));
    CHECK(hash.hex() == "c1b5f1c5503a56eb");
  }
}

TEST_CASE("a carry with too few lanes cuts nothing") {
  const TestVolume volume = filled({40, 20, 20}, 65535);
  for (AlignedRig& rig : rigs_for(paper_ball(10))) {
    const std::vector<std::uint16_t> carry(static_cast<std::size_t>(rig.table().row_lanes) - 1);
    const auto out = rig.run(volume, pose_at<FixedNumbers>({10, 10, 10}),
                             removal_rate<FixedNumbers>(1.0, false), carry);
    CHECK(out.density == volume.density);
    CHECK(out.removed.density_steps == 0);
  }
}

TEST_CASE("only tools on one lattice can be aligned") {
  CHECK(can_align(paper_ball(16)));
  CHECK(can_align(odd_ball(3)));
  CHECK(can_align(paper_ball(64)));
  CHECK_FALSE(can_align({}));
  CHECK_FALSE(can_align(paper_ball(65)));
  CHECK_FALSE(can_align(std::vector<ToolOffset>{{0, 0, 0}, {1, 0, 0}}));
  CHECK_FALSE(can_align(std::vector<ToolOffset>{{0, 0, 0}, {2, 0, 0}, {0, 0, 0}}));
}
