// SPDX-License-Identifier: Apache-2.0
// The definitions of the method `aligned` against double precision and the method `gather`.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include <doctest/doctest.h>

#include "controller/plan/tables/sample_tables.hpp"
#include "tests/kernel/definitions.hpp"
#include "tests/kernel/exact_field.hpp"

using namespace kerf;
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
    for (std::int32_t z = 0; z < 7; ++z) {
      for (std::int32_t y = 0; y < 8; ++y) {
        for (std::int32_t x = 0; x < 9; ++x) {
          const auto exact = gradient_exact(taps, volume.grid, volume.density, {x, y, z});
          const auto stored =
              gradient_dense<FixedNumbers>(kernel, volume.grid, volume.density, {x, y, z});
          REQUIRE(round_shift(taps.factor * exact.x, taps.shift) == stored.x);
          REQUIRE(round_shift(taps.factor * exact.y, taps.shift) == stored.y);
          REQUIRE(round_shift(taps.factor * exact.z, taps.shift) == stored.z);
        }
      }
    }
  }
}

TEST_CASE("contact and modification sums are double's within 1.7e-4 of full scale") {
  const TestVolume volume = ball_of_12();
  const auto tool = paper_ball(10);
  const auto field = gradients<DoubleNumbers>(GradientKernel::farid, volume);
  const ExactField exact(kExactFarid, volume);
  const double full_scale = kDensityMax * std::numbers::pi * 25;  // a flat face at the equator
  Cutter<FixedNumbers> fixed(16);
  Cutter<DoubleNumbers> wide(16);
  double worst_contact = 0, worst_modification = 0, largest = 0;
  for (int i = 0; i < 60; ++i) {
    const auto pose = pose_at<FixedNumbers>(place(i));
    const auto truth_pose = pose_at<DoubleNumbers>(
        {double(pose.centre_vox.x), double(pose.centre_vox.y), double(pose.centre_vox.z)});
    const auto contact = aligned_contact_sum(kExactFarid, exact, tool, pose);
    const auto truth = contact_sum<DoubleNumbers>(volume.grid, field, tool, truth_pose);
    largest = std::max(largest, std::abs(truth.x));
    for (const double error : {double(contact.x) / 256 - truth.x, double(contact.y) / 256 - truth.y,
                               double(contact.z) / 256 - truth.z}) {
      worst_contact = std::max(worst_contact, std::abs(error));
    }
    overlap<FixedNumbers>(volume.grid, tool, pose, FixedNumbers::kStepOne, fixed.overlap);
    overlap<DoubleNumbers>(volume.grid, tool, truth_pose, 1.0, wide.overlap);
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

// N7
TEST_CASE("the order of the samples does not change a sum of the method aligned") {
  const TestVolume volume = random_volume({24, 22, 20}, 12);
  const ExactField field(kExactFarid, volume);
  auto tool = paper_ball(8);
  const auto pose = pose_at<FixedNumbers>({11.37, 10.21, 9.83});
  const auto first = aligned_contact_sum(kExactFarid, field, tool, pose);
  std::mt19937 random(7);
  bool same = true;
  for (int n = 0; n < 1000; ++n) {
    std::shuffle(tool.begin(), tool.end(), random);
    same = same && aligned_contact_sum(kExactFarid, field, tool, pose) == first;
  }
  CHECK(same);
}
