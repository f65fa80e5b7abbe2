// SPDX-License-Identifier: Apache-2.0
// Every instruction set against the definitions of the method `aligned`, bit for bit.
#include <array>
#include <cstdlib>
#include <random>
#include <string>
#include <utility>

#include <doctest/doctest.h>

#include "tests/case_count.hpp"
#include "tests/kernel/aligned_support.hpp"
#include "tests/kernel/hash.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

struct Named {
  const char* name;
  std::vector<ToolOffset> offsets;
  int cases;  ///< per volume
};

/// Longer by 32 than the tool, so that whole vectors are written; shorter than a vector with small
/// tools; shorter than the tool.
std::array<VoxelGrid, 3> grids_for(VoxelIndex size) {
  return {VoxelGrid{size.x + 37, size.y + 8, size.z + 9},
          VoxelGrid{size.x + 3, size.y + 9, size.z + 2},
          VoxelGrid{size.x / 2 + 1, size.y + 1, size.z / 2 + 2}};
}

RemovalRate<FixedNumbers> random_rate(std::mt19937& random) {
  RemovalRate<FixedNumbers> rate;
  switch (random() % 6) {
    case 0:
      return removal_rate<FixedNumbers>(1.0, false);
    case 1:
      return removal_rate<FixedNumbers>(0.001 * double(random() % 3000), true);
    case 2:
      rate.mantissa = random() % 2 == 0 ? 16384 : 32768;
      break;
    default:
      rate.mantissa = 16384 + static_cast<std::int32_t>(random() % 16385);
  }
  rate.exponent = static_cast<int>(random() % (random() % 3 == 0 ? 33 : 6));
  return rate;
}

/// Fractions of a step owed by each lane: any, none, or as much as can be.
std::vector<std::uint16_t> random_carry(std::size_t lanes, std::mt19937& random) {
  const auto kind = random() % 8;
  std::vector<std::uint16_t> carry(lanes);
  for (auto& owed : carry) {
    owed = kind == 0 ? 0 : static_cast<std::uint16_t>(kind == 1 ? 65535 : random());
  }
  return carry;
}

/// Which faces of the volume the tool's box sticks out of, over many cases.
struct Clipped {
  std::array<int, 3> low{}, high{};
  int corner = 0, none = 0, outside = 0;

  void count(const AlignedTable& table, const ToolPose<FixedNumbers>& pose, const VoxelGrid& grid) {
    const std::array<std::int32_t, 3> centre{pose.centre_vox.x.raw(), pose.centre_vox.y.raw(),
                                             pose.centre_vox.z.raw()};
    const std::array<std::int32_t, 3> edge{grid.nx, grid.ny, grid.nz};
    const std::array<std::int32_t, 3> size{table.box.x, table.box.y, table.box.z};
    int faces = 0;
    bool misses = false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int32_t from = ((centre[axis] + table.low[axis] * 32768) >> 16) - kGradientReach;
      low[axis] += from < 0 ? 1 : 0;
      high[axis] += from + size[axis] > edge[axis] ? 1 : 0;
      faces += from < 0 || from + size[axis] > edge[axis] ? 1 : 0;
      misses = misses || from + size[axis] <= 0 || from >= edge[axis];
    }
    corner += faces == 3 && !misses ? 1 : 0;
    none += faces == 0 ? 1 : 0;
    outside += misses ? 1 : 0;
  }
};

}  // namespace

// At least 100 000 cases for each instruction set: ten tools, each gradient kernel, twelve kinds
// of volume in three widths; poses, rates and carries at random and at the ends of their ranges.
// The definition is computed once a case and compared with every set: contact and modification sum,
// volume, carry, removed sum and changed box.
TEST_CASE("every instruction set gives the bits of the definition, wherever the tool is") {
  const std::array<Named, 10> tools{{{"one voxel", box_tool(1, 1, 1), 700},
                                     {"cube of 3", box_tool(3, 3, 3), 600},
                                     {"box of 2 x 9 x 5", box_tool(2, 9, 5), 500},
                                     {"ragged 11 x 6 x 8", ragged_tool(11, 6, 8, 5), 300},
                                     {"ball of 10", paper_ball(10), 450},
                                     {"ball of 16", paper_ball(16), 180},
                                     {"cube of 16", box_tool(16, 16, 16), 40},
                                     {"ball of 27", paper_ball(27), 8},
                                     {"ragged 28 x 7 x 33", ragged_tool(28, 7, 33, 6), 15},
                                     {"ball of 32", paper_ball(32), 3}}};
  [[maybe_unused]] int total = 0;
  for (const Named& tool : tools) {
    CAPTURE(std::string(tool.name));
    std::mt19937 random(7);
    std::array rigs_of{rigs_for(tool.offsets, kExactFarid), rigs_for(tool.offsets, kExactSobel5),
                       rigs_for(tool.offsets, kExactCentral)};
    const AlignedTable& table = rigs_of[0].front().table();
    const VoxelIndex size = table.size;
    Cutter<FixedNumbers> cutter(static_cast<std::size_t>(std::max({size.x, size.y, size.z})) + 1);
    int count = 0, felt = 0, cut_away = 0;
    Clipped clipped;
    for (int fill = 0; fill < kFills; ++fill) {
      for (const VoxelGrid& grid : grids_for(size)) {
        const TestVolume volume = hard_volume(grid, fill, static_cast<std::uint32_t>(fill));
        // Each gradient kernel once with every fill: the three ny leave different rests.
        std::vector<AlignedRig>& rigs = rigs_of[static_cast<std::size_t>(fill + grid.ny) % 3];
        const ExactTaps& taps = rigs.front().table().taps;
        const ExactField field(taps, volume);
        for (int i = 0; i < cases(tool.cases); ++i, ++count) {
          const auto pose = random_pose(grid, size, random);
          const auto rate = random_rate(random);
          const auto carry = random_carry(static_cast<std::size_t>(table.row_lanes) + 3, random);
          const AlignedOutcome truth = outcome_by_definition(taps, volume, field, tool.offsets,
                                                             pose, rate, carry, cutter.overlap);
          clipped.count(table, pose, grid);
          felt += truth.contact == SumVec<FixedNumbers>{} ? 0 : 1;
          cut_away += truth.removed.density_steps != 0 ? 1 : 0;
          for (AlignedRig& rig : rigs) {
            const bool same = rig.run(volume, pose, rate, carry) == truth;
            if (!same) {
              INFO(std::string(rig.kernels().name), ", fill ", fill, ", width ", grid.nx, ", case ",
                   i);
              REQUIRE(same);
            }
          }
        }
      }
    }
    total += count;
    if (count < 500) continue;  // too few to meet everything: large tools, sanitizers
    CHECK(felt > count / 3);
    CHECK(cut_away > count / 8);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      CHECK(clipped.low[axis] > count / 8);
      CHECK(clipped.high[axis] > count / 8);
    }
    CHECK(clipped.corner > count / 8);
    CHECK(clipped.none > count / 20);
    CHECK(clipped.outside > count / 50);
  }
#ifndef KERF_FEWER_CASES
  CHECK(total >= 100'000);
#endif
}

TEST_CASE("contact by the table equals the definition without any cache") {
  const TestVolume volume = random_volume({20, 17, 15}, 9);
  const auto tool = paper_ball(6);
  const auto exact = [&](VoxelIndex v) {
    return gradient_exact(kExactFarid, volume.grid, volume.density, v);
  };
  for (AlignedRig& rig : rigs_for(tool)) {
    for (const auto& at : {std::array{10.3, 8.7, 7.2}, {1.6, 8.1, 7.9}, {18.2, 15.9, 13.1}}) {
      const auto pose = pose_at<FixedNumbers>(at);
      CHECK(rig.run(volume, pose, {}, {}).contact ==
            aligned_contact_sum(kExactFarid, exact, tool, pose));
    }
  }
}

// N7
TEST_CASE("the order in which a tool's samples are listed does not change its table") {
  auto tool = ragged_tool(7, 6, 5, 3);
  const TestVolume volume = random_volume({50, 20, 18}, 5);
  const auto pose = pose_at<FixedNumbers>({20.37, 9.21, 8.83});
  const auto rate = removal_rate<FixedNumbers>(0.3, true);
  const std::vector<std::uint16_t> carry(64);
  const AlignedOutcome first = rigs_for(tool).front().run(volume, pose, rate, carry);
  std::mt19937 random(8);
  for (int n = 0; n < 20; ++n) {
    std::shuffle(tool.begin(), tool.end(), random);
    for (AlignedRig& rig : rigs_for(tool)) CHECK(rig.run(volume, pose, rate, carry) == first);
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
  // Fractions of all 16 bits, so that every rounding matters.
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
          pose_at<FixedNumbers>({tick * 0.5713 - 6, 10 + tick * 0.0317, 16 - tick * 0.0629});
      AlignedOutcome out = rig.run(volume, pose, rate, carry);
      hash.add(out.contact);
      hash.add(out.modification);
      hash.add(out.removed.density_steps);
      volume.density = std::move(out.density);
      carry = std::move(out.carry);
    }
    for (const Density rho : volume.density) hash.add(std::uint64_t{rho});
    CAPTURE(std::string(rig.kernels().name));
    CHECK(hash.hex() == "e590e635b94f34ce");
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
