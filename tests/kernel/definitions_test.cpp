// SPDX-License-Identifier: Apache-2.0
// The definitions of the method `aligned` against double precision and the method `gather`.
#include "tests/kernel/definitions.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <doctest/doctest.h>

#include "controller/plan/tables/sample_tables.hpp"
#include "tests/kernel/aligned_support.hpp"
#include "tests/kernel/support.hpp"
#include "tests/support/voxels.hpp"

namespace kerf::definitions_test {

using namespace kerf::test;

namespace {

constexpr double kGradientUnit = 7.0 / 2097152.0;  // of an exact sum, in density steps per voxel

TestVolume ball_of_12() {
  return solid({48, 44, 42}, [](double x, double y, double z) {
    return std::hypot(x - 22.3, y - 21.8, z - 20.1) - 12.0;
  });
}

/// Places around the ball and within it, tool of 10 voxels inside the volume.
std::array<double, 3> place(int i) {
  return {22 + 13 * std::sin(i * 0.71), 21 + 13 * std::sin(i * 0.37 + 1),
          20 + 12 * std::cos(i * 0.53)};
}

}  // namespace

TEST_CASE("the exact gradient rounds to the stored one") {
  const TestVolume volume = random_volume({9, 8, 7}, 4);
  for (const auto kernel :
       {GradientKernel::farid, GradientKernel::sobel5, GradientKernel::central}) {
    const ExactTaps& taps = exact_taps(kernel);
    for (const auto& [x, y, z] : voxels(VoxelBox{{0, 0, 0}, {9, 8, 7}})) {
      const auto exact = gradient_exact(taps, volume.grid, volume.density, {x, y, z});
      const auto stored =
          gradient_dense<FixedNumbers>(kernel, volume.grid, volume.density, {x, y, z});
      REQUIRE(round_shift(taps.factor * exact.x, taps.shift) == stored.x);
      REQUIRE(round_shift(taps.factor * exact.y, taps.shift) == stored.y);
      REQUIRE(round_shift(taps.factor * exact.z, taps.shift) == stored.z);
    }
  }
}

TEST_CASE("contact and modification sums are double's within 1.7e-4 of full scale") {
  const TestVolume volume = ball_of_12();
  const auto tool = paper_ball(10);
  const auto field = gradients<DoubleNumbers>(GradientKernel::farid, volume);
  const ExactField exact(kExactFarid, volume);
  const double full_scale = kDensityMax * std::numbers::pi * 25;  // a flat face at the equator
  Cutter<> fixed(16);
  Cutter<DoubleNumbers> wide(16);
  double worst_contact = 0, worst_modification = 0, largest = 0;
  for (int i = 0; i < 60; ++i) {
    const auto pose = pose_at(place(i));
    const auto truth_pose = pose_at<DoubleNumbers>(
        {double(pose.centre_vox.x), double(pose.centre_vox.y), double(pose.centre_vox.z)});
    const auto contact = aligned_contact_sum(kExactFarid, exact, tool, pose);
    const auto truth = contact_sum<DoubleNumbers>(volume.grid, field, tool, truth_pose);
    largest = std::max(largest, std::abs(truth.x));
    for (const double error : {double(contact.x) / 256 - truth.x, double(contact.y) / 256 - truth.y,
                               double(contact.z) / 256 - truth.z}) {
      worst_contact = std::max(worst_contact, std::abs(error));
    }
    overlap(volume.grid, tool, pose, FixedNumbers::kStepOne, fixed.overlap);
    overlap(volume.grid, tool, truth_pose, 1.0, wide.overlap);
    const auto cut =
        exact_modification_sum(exact, volume.grid, volume.density, fixed.overlap, tool.size());
    const auto cut_truth =
        modification_sum<DoubleNumbers>(volume.grid, field, volume.density, wide.overlap);
    const double unit = kGradientUnit / FixedNumbers::kWeightOne;
    for (const double error :
         {double(cut.x) * unit - cut_truth.x, double(cut.y) * unit - cut_truth.y,
          double(cut.z) * unit - cut_truth.z}) {
      worst_modification = std::max(worst_modification, std::abs(error));
    }
  }
  CHECK(largest > 0.3 * full_scale);
  CHECK(worst_contact / full_scale <= 1.7e-4);
  CHECK(worst_modification / full_scale <= 1.7e-4);
}

// N8: the largest sums that each bound in the headers allows. Under the undefined-behaviour checks
// an overflow stops these tests; without them the exact value does.

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
  const auto sum =
      contact_sum<FixedNumbers>(grid, field, box_tool(16, 16, 16), pose_at({9.37, 9.81, 10.11}));
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
                                       pose_at({40.37, 40.81, 40.11}));
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

}  // namespace kerf::definitions_test
