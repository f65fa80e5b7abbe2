// SPDX-License-Identifier: Apache-2.0
// Every instruction set against the definitions of the method `aligned`, bit for bit.
#include <array>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>
#include <utility>

#include <doctest/doctest.h>

#include "tests/case_count.hpp"
#include "tests/kernel/aligned_support.hpp"
#include "tests/support/sets_to_run.hpp"

namespace kerf::aligned_test {

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
    Cutter<> cutter(static_cast<std::size_t>(std::max({size.x, size.y, size.z})) + 1);
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

// N7
TEST_CASE("the order in which a tool's samples are listed does not change its table") {
  auto tool = ragged_tool(7, 6, 5, 3);
  const TestVolume volume = random_volume({50, 20, 18}, 5);
  const auto pose = pose_at({20.37, 9.21, 8.83});
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

TEST_CASE("a carry with too few lanes cuts nothing") {
  const TestVolume volume = filled({40, 20, 20}, 65535);
  for (AlignedRig& rig : rigs_for(paper_ball(10))) {
    const std::vector<std::uint16_t> carry(static_cast<std::size_t>(rig.table().row_lanes) - 1);
    const auto out =
        rig.run(volume, pose_at({10, 10, 10}), removal_rate<FixedNumbers>(1.0, false), carry);
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

// The exact sums of the method `aligned` at the ends of their ranges: 32-bit lanes that must be
// widened in time, and tools as large as the method takes.

namespace {

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
        tap *= axis == slope_axis ? kExactFarid.slope[step[axis]] : kExactFarid.smooth[step[axis]];
        at[axis] = (offset[axis] - table.low[axis]) / 2 + static_cast<std::int32_t>(step[axis]);
      }
      sum[box.index(at[0], at[1], at[2])] += tap;
    }
  }
  for (std::int32_t& s : sum) s -= ((s + 256) >> 9) * 512;
  return sum;
}

}  // namespace

TEST_CASE("large tools feel the same on every instruction set") {
  for (const int size : {32, 64}) {
    const auto tool = paper_ball(size);
    std::vector<AlignedRig> rigs = rigs_for(tool);
    for (const int fill : {3, 4}) {
      const TestVolume volume = hard_volume({size + 12, size + 6, size + 5}, fill, 3);
      const ExactField field(kExactFarid, volume);
      std::mt19937 random(1);
      for (int i = 0; i < (size == 32 ? 20 : 4); ++i) {
        const auto pose = random_pose(volume.grid, rigs.front().table().size, random);
        const auto truth = aligned_contact_sum(kExactFarid, field, tool, pose);
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
      const ExactField field(kExactFarid, volume);
      const auto pose = pose_at({9.5, 9.5, 9.5});
      const auto truth = aligned_contact_sum(kExactFarid, field, cube, pose);
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

TEST_CASE("a table is widened as seldom as its largest half allows, every 127 chunks at worst") {
  for (const ExactTaps& taps : {kExactFarid, kExactSobel5, kExactCentral}) {
    for (const auto& tool : {box_tool(1, 1, 1), paper_ball(10), paper_ball(16), paper_ball(32),
                             box_tool(16, 16, 16), ragged_tool(28, 7, 33, 6)}) {
      for (const AlignedRig& rig : rigs_for(tool, taps)) {
        const AlignedTable& table = rig.table();
        std::int64_t largest = 0;
        for (std::size_t list = 0; list < (table.fused ? 1 : 3); ++list) {
          for (std::int32_t i = 0; i < table.chunk_count[list]; ++i) {
            const std::int16_t* run = table.vectors + table.chunks[list][i].vector;
            for (std::int32_t n = 0; n < (table.fused ? 6 : 2) * table.lanes; ++n) {
              largest = std::max<std::int64_t>(largest, std::abs(int{run[n]}));
            }
          }
        }
        CHECK(largest <= 256);
        const std::int64_t chunk = 2 * largest * 32768;  // two products in each 32-bit lane
        CHECK(table.flush * chunk <= std::numeric_limits<std::int32_t>::max());
        CHECK((table.flush + 1) * chunk > std::numeric_limits<std::int32_t>::max());
        CHECK(table.flush >= 127);
      }
    }
  }
}

// A table that no tool has: every half as large as it can be, against air, chunk after chunk.
TEST_CASE("lanes hold 127 chunks of the widest products and not one more, on every list length") {
  for (auto set = sets_to_run(); *set != nullptr; ++set) {
    const KernelSet& kernels = **set;
    const auto lanes = static_cast<std::size_t>(kernels.lanes);
    for (const bool fused : {false, true}) {
      if (fused && !kernels.can_fuse) continue;
      std::vector<std::int16_t> run;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        run.insert(run.end(), lanes, std::int16_t{-256});
        run.insert(run.end(), lanes, std::int16_t{-256});
      }
      const std::vector<std::int16_t> box(8 * 8 * 8, std::int16_t{-32768});
      for (const std::size_t count : {1u, 126u, 127u, 128u, 253u, 254u, 255u, 1000u}) {
        const std::vector<AlignedChunk> chunks(count, AlignedChunk{0, 0});
        AlignedTable table;
        table.box = {8, 8, 8};
        table.lanes = kernels.lanes;
        table.flush = 127;
        table.fused = fused;
        table.vectors = run.data();
        for (std::size_t list = 0; list < (fused ? 1 : 3); ++list) {
          table.chunks[list] = chunks.data();
          table.chunk_count[list] = static_cast<std::int32_t>(count);
        }
        const std::int64_t exact = static_cast<std::int64_t>(count * lanes) * 256 * 32768 * 513;
        const auto all_are = [&](std::int64_t wanted) {
          std::int64_t sum[3][8];
          kernels.correlate(table, box.data(), sum);
          bool same = true;
          for (const auto& axis : sum) {
            for (const std::int64_t corner : axis) same = same && corner == wanted;
          }
          return same;
        };
        CAPTURE(std::string(kernels.name));
        CAPTURE(count);
        CHECK(all_are(exact));
        table.flush = 128;  // 2^24 * 128 is one too many; the plain loops widen every chunk
        CHECK(all_are(exact) == (count < 128 || &kernels == &kScalarSet));
      }
    }
  }
}

}  // namespace kerf::aligned_test
