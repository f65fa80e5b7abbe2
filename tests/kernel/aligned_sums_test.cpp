// SPDX-License-Identifier: Apache-2.0
// The exact sums of the method `aligned` at the ends of their ranges: 32-bit lanes that must be
// widened in time, and tools as large as the method takes.
#include <array>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>

#include <doctest/doctest.h>

#include "tests/kernel/aligned_support.hpp"

using namespace kerf;
using namespace kerf::test;

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
      const auto pose = pose_at<FixedNumbers>({9.5, 9.5, 9.5});
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
  for (auto set = kernel_sets(); *set != nullptr; ++set) {
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
