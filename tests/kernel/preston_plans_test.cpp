// SPDX-License-Identifier: Apache-2.0
// Cutting by force from the ratios that the plans `aligned` and `splat` leave: the bits of the
// plain overlap, on every instruction set.
#include <random>
#include <string>

#include <doctest/doctest.h>

#include "controller/kernel/splat.hpp"
#include "controller/scene/sample_tool.hpp"
#include "tests/kernel/aligned_support.hpp"
#include "tests/kernel/preston_support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

using N = FixedNumbers;

struct Cut {
  std::vector<Density> density;
  Removed removed;
  std::int64_t carry;

  friend bool operator==(const Cut& a, const Cut& b) {
    return a.density == b.density && a.removed.density_steps == b.removed.density_steps &&
           a.removed.changed == b.removed.changed && a.carry == b.carry;
  }
};

template <class Overlap>
Cut cut_of(const TestVolume& volume, const ToolPose<N>& pose, const Overlap& overlap) {
  static std::vector<CoveredVoxel<N>> memory(60'000);
  PrestonPlan<N> plan;
  plan.rate.fill(force_rate<N>(3000));
  PrestonState<N> state;
  Cut cut{volume.density, {}, 0};
  const auto frame = frame_at<N>(
      {double(pose.centre_vox.x), double(pose.centre_vox.y), double(pose.centre_vox.z)}, 4.0);
  auto covered = covered_voxels<N>(volume.grid, std::span<const Density>(cut.density), {}, overlap,
                                   frame, std::span<CoveredVoxel<N>>(memory));
  const auto drive = cut_drive<N>(Q16(1.5), Q16(0), Q30(0.9));
  cut.removed = cut_by_force(plan, drive, std::span<Density>(cut.density), state, covered).removed;
  cut.carry = state.carry[0];
  return cut;
}

}  // namespace

TEST_CASE("every plan and instruction set cuts the same by force, inside and across borders") {
  const auto tool = ragged_tool(9, 7, 8, 4);
  const SampleTool samples(tool, SampleOrder::scattered);
  SplatMemory splat_memory;
  splat_memory.hold({14, 14, 14}, tool.size());
  BoxMemory memory;
  memory.hold({9, 7, 8}, true);
  std::vector<AlignedTool> tables;
  for (auto set = kernel_sets(); *set != nullptr; ++set)
    tables.emplace_back(tool, kExactFarid, **set);
  Cutter<N> cutter(20);
  std::mt19937 random(11);
  int cuts = 0;
  for (int fill = 0; fill < kFills; ++fill) {
    const VoxelGrid grid = fill % 4 == 3 ? VoxelGrid{7, 9, 8} : VoxelGrid{44, 14, 12};
    const TestVolume volume = hard_volume(grid, fill, static_cast<std::uint32_t>(fill));
    for (int i = 0; i < 60; ++i) {
      const auto pose = random_pose(grid, {9, 7, 8}, random);
      overlap<N>(grid, tool, pose, N::kStepOne, cutter.overlap);
      const Cut truth = cut_of(volume, pose, cutter.overlap);
      cuts += truth.removed.density_steps != 0 ? 1 : 0;
      for (auto set = kernel_sets(); *set != nullptr; ++set) {
        INFO(std::string((*set)->name), ", fill ", fill, ", case ", i);
        std::vector<Density> density = volume.density;
        const AlignedTable& table = tables[static_cast<std::size_t>(set - kernel_sets())].table();
        const AlignedTick aligned(**set, table, memory.view(), grid, density, pose);
        static_cast<void>(aligned.press());
        const bool same = cut_of(volume, pose, aligned.overlap()) == truth;
        REQUIRE(same);

        const SplatTick splat(**set, samples.table(), kExactFarid, splat_memory.view(), grid,
                              density, pose);
        splat.copy();
        splat.splat();
        static_cast<void>(splat.press(N::kStepOne));
        const bool splat_same = cut_of(volume, pose, splat.overlap()) == truth;
        REQUIRE(splat_same);
      }
    }
  }
  CHECK(cuts > 200);
}
