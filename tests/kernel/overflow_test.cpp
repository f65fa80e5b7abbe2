// SPDX-License-Identifier: Apache-2.0
// N8: the largest sums that each bound in the headers allows. Under the undefined-behaviour checks
// an overflow stops these tests; without them the exact value does.
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include <doctest/doctest.h>

#include "tests/kernel/definitions.hpp"
#include "tests/kernel/support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

constexpr std::int16_t kSteepest = std::numeric_limits<std::int16_t>::max();
constexpr std::int16_t kLowest = std::numeric_limits<std::int16_t>::min();

/// An overlap that covers `grid` whole.
struct FullCover {
  explicit FullCover(const VoxelGrid& grid)
      : memory(grid.voxel_count(), FixedNumbers::kWeightOne), overlap{memory, grid.box(), -2} {}
  std::vector<std::int32_t> memory;
  OverlapBox<FixedNumbers> overlap;
};

}  // namespace

TEST_CASE("4096 samples of the steepest gradient add up without overflow") {
  const VoxelGrid grid{20, 20, 20};
  const std::vector<Gradient<FixedNumbers>> field(grid.voxel_count(),
                                                  {kSteepest, kLowest, kSteepest});
  const auto sum = contact_sum<FixedNumbers>(grid, field, box_tool(16, 16, 16),
                                             pose_at<FixedNumbers>({9.37, 9.81, 10.11}));
  CHECK(sum.x == 4096LL * 32768 * kSteepest);
  CHECK(sum.y == 4096LL * 32768 * kLowest);
}

TEST_CASE("a modification force of stored gradients at the ends of their range is exact") {
  const VoxelGrid grid{64, 64, 64};
  const std::vector<Gradient<FixedNumbers>> field(grid.voxel_count(),
                                                  {kLowest, kSteepest, kLowest});
  const FullCover full(grid);
  const TestVolume volume = filled(grid, 65535);
  const auto sum = modification_sum<FixedNumbers>(grid, field, volume.density, full.overlap);
  CHECK(sum.x == std::int64_t{64 * 64 * 64} * 32768 * kLowest);
  CHECK(sum.y == std::int64_t{64 * 64 * 64} * 32768 * kSteepest);
}

TEST_CASE("the steepest volume's exact gradient is the bound that the sums are sized by") {
  std::int64_t steepest = 0;
  for (const bool rising : {true, false}) {
    const TestVolume volume = made_of({5, 5, 5}, [&](std::int32_t x, auto, auto) {
      return static_cast<Density>((x > 2) == rising && x != 2 ? 65535 : 0);
    });
    const auto g = gradient_exact(kExactFarid, volume.grid, volume.density, {2, 2, 2});
    CHECK(g.x == (rising ? 1 : -1) * kMaxExactGradient);
    steepest = std::max(steepest, g.x);
  }
  CHECK(steepest == kMaxExactGradient);
}

TEST_CASE("a contact of the largest tool on the steepest gradient is exact in the method aligned") {
  const auto steepest = [](VoxelIndex) {
    return SumVec<FixedNumbers>{kMaxExactGradient, -kMaxExactGradient, 0};
  };
  const auto sum = aligned_contact_sum(kExactFarid, steepest, box_tool(64, 64, 64),
                                       pose_at<FixedNumbers>({40.37, 40.81, 40.11}));
  const std::int64_t total = 64LL * 64 * 64 * kMaxExactGradient;
  CHECK(sum.x == kept_bits(kExactFarid, total));
  CHECK(sum.y == kept_bits(kExactFarid, -total));
  CHECK(sum.z == 0);
  // Corners at opposite ends: the widest way that a lerp can go.
  const std::array<std::int64_t, 8> corner{sum.x, sum.y, sum.y, sum.x, sum.y, sum.x, sum.x, sum.y};
  for (const std::int32_t w : {0, 1, 16384, 32767, 32768}) {
    const auto value = trilinear<FixedNumbers, std::int64_t>(corner, {w, w, w});
    CHECK(value <= sum.x);
    CHECK(value >= sum.y);
  }
  CHECK(trilinear<FixedNumbers, std::int64_t>(corner, {32768, 32768, 32768}) == sum.y);
}

TEST_CASE(
    "a modification force of the largest tool with unshifted sums is exact in the method aligned") {
  const VoxelGrid grid{30, 30, 20};
  REQUIRE(grid.voxel_count() == kNarrowSumSamples);
  const FullCover full(grid);
  const TestVolume volume = filled(grid, 65535);
  const auto steepest = [](VoxelIndex) {
    return SumVec<FixedNumbers>{kMaxExactGradient, -kMaxExactGradient, 1};
  };
  const auto sum =
      exact_modification_sum(steepest, grid, volume.density, full.overlap, kNarrowSumSamples);
  const auto bound = static_cast<std::int64_t>(kNarrowSumSamples) * 32768 * kMaxExactGradient;
  CHECK(sum.x == bound);
  CHECK(sum.y == -bound);
  CHECK(sum.z == static_cast<std::int64_t>(kNarrowSumSamples) * 32768);
}

TEST_CASE("a modification force of a larger tool is exact in steps of 2^16, beyond 63 bits") {
  const VoxelGrid grid{40, 40, 40};
  const FullCover full(grid);
  const TestVolume volume = filled(grid, 65535);
  const auto steepest = [](VoxelIndex v) {
    return SumVec<FixedNumbers>{kMaxExactGradient, -kMaxExactGradient, v.x == 0 ? 1 : 0};
  };
  const auto sum =
      exact_modification_sum(steepest, grid, volume.density, full.overlap, grid.voxel_count());
  CHECK(sum.x == std::int64_t{64'000} * kMaxExactGradient / 2);  // 32768 / 2^16
  CHECK(sum.y == -(std::int64_t{64'000} * kMaxExactGradient / 2));
  CHECK(sum.z == 1600 / 2);
}
