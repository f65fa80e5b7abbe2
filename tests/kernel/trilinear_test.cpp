// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "controller/kernel/sampling.hpp"
#include "shared/numeric/numbers.hpp"
#include "tests/kernel/support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

/// A position within cell (0, 0, 0) from three 16-bit fractions.
VoxelVec<Q16> in_cell(std::uint16_t x, std::uint16_t y, std::uint16_t z) {
  return {Q16::from_raw(x), Q16::from_raw(y), Q16::from_raw(z)};
}

}  // namespace

// N5
TEST_CASE("Q15 weights with 8 kept bits are within 3.1 steps of exact interpolation, 0.3 rms") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> fraction(0.0, 1.0);
  double worst = 0, square = 0;
  constexpr int kCases = 6000;
  for (int n = 0; n < kCases; ++n) {
    std::array<std::int32_t, 8> kept{};
    std::array<double, 8> exact{};
    for (std::size_t c = 0; c < 8; ++c) {
      const auto value = static_cast<std::int16_t>(random() >> 16);
      kept[c] = value * FixedNumbers::kSampleOne;
      exact[c] = value;
    }
    const VoxelVec<double> t{fraction(random), fraction(random), fraction(random)};
    const auto weight = [](double w) {
      return static_cast<std::int32_t>(std::lround(w * FixedNumbers::kWeightOne));
    };
    const double value = trilinear<FixedNumbers>(kept, {weight(t.x), weight(t.y), weight(t.z)});
    const double error = value / FixedNumbers::kSampleOne - trilinear<DoubleNumbers>(exact, t);
    worst = std::max(worst, std::abs(error));
    square += error * error;
  }
  CHECK(worst <= 3.1);
  CHECK(std::sqrt(square / kCases) <= 0.3);
}

// N6
TEST_CASE("equal corners interpolate to themselves, exactly") {
  CHECK(rc::check([](std::int16_t value, std::uint16_t x, std::uint16_t y, std::uint16_t z) {
    std::array<std::int32_t, 8> corner{};
    corner.fill(value * FixedNumbers::kSampleOne);
    RC_ASSERT(trilinear<FixedNumbers>(corner, cell_at<FixedNumbers>(in_cell(x, y, z)).weight) ==
              corner[0]);
  }));
}

TEST_CASE("corners at both ends of the range do not overflow") {
  constexpr std::int32_t kLow = std::numeric_limits<std::int16_t>::min() * FixedNumbers::kSampleOne;
  constexpr std::int32_t kHigh =
      std::numeric_limits<std::int16_t>::max() * FixedNumbers::kSampleOne;
  const std::array<std::int32_t, 8> corner = {kLow, kHigh, kHigh, kLow, kHigh, kLow, kLow, kHigh};
  for (const std::int32_t w : {0, 1, 16384, 32767, 32768}) {
    const std::int32_t value = trilinear<FixedNumbers>(corner, {w, w, w});
    CHECK(value >= kLow);
    CHECK(value <= kHigh);
  }
  CHECK(trilinear<FixedNumbers>(corner, {32768, 32768, 32768}) == kHigh);
}

TEST_CASE_TEMPLATE("trilinear reproduces a linear field inside the cell", N, FixedNumbers,
                   DoubleNumbers) {
  const auto field = [](double x, double y, double z) {
    return 1000.0 + 2000.0 * x - 3000.0 * y + 4000.0 * z;
  };
  std::array<typename N::Sample, 8> corner{};
  for (std::size_t c = 0; c < 8; ++c) {
    corner[c] = static_cast<typename N::Sample>(
        field(double(c & 1), double(c >> 1 & 1), double(c >> 2)) * N::kSampleOne);
  }
  for (double t = 0.0; t < 1.0; t += 0.0625) {
    using Real = typename N::Real;
    const auto cell = cell_at<N>({Real(t), Real(1 - t), Real(t / 2)});
    // A weight of 1 - 0 belongs to the next cell: read it as this one's far end.
    auto weight = cell.weight;
    if (cell.low.y == 1) weight.y = N::kWeightOne;
    const double value = double(trilinear<N>(corner, weight)) / double(N::kSampleOne);
    CHECK(value == doctest::Approx(field(t, 1 - t, t / 2)).epsilon(1e-6));
  }
}

// N10
TEST_CASE_TEMPLATE("halving the voxel quarters the error of interpolating a smooth field", N,
                   FixedNumbers, DoubleNumbers) {
  const auto field = [](double x, double y, double z) {
    return 30000 * std::sin(2 * x + 0.3) * std::cos(1.5 * y) * std::sin(z + 1);
  };
  const double curvature = 30000 * (4 + 2.25 + 1);  // |fxx| + |fyy| + |fzz|, at most
  const auto errors = [&](double h) {
    using Real = typename N::Real;
    std::mt19937 random(10);
    std::uniform_real_distribution<double> unit(0, 1);
    double square = 0, worst = 0;
    constexpr int kPlaces = 20'000;
    for (int n = 0; n < kPlaces; ++n) {
      const VoxelVec<Real> at{Real(unit(random) / h), Real(unit(random) / h),
                              Real(unit(random) / h)};
      const Cell<N> cell = cell_at<N>(at);
      std::array<typename N::Sample, 8> corner{};
      for (std::size_t c = 0; c < 8; ++c) {
        const auto along = [&](std::int32_t low, std::size_t axis) {
          return h * (low + static_cast<int>(c >> axis & 1));
        };
        const double value =
            field(along(cell.low.x, 0), along(cell.low.y, 1), along(cell.low.z, 2));
        corner[c] = static_cast<typename N::Sample>(value * double(N::kSampleOne));
      }
      const double value = double(trilinear<N>(corner, cell.weight)) / double(N::kSampleOne);
      const double error = value - field(h * double(at.x), h * double(at.y), h * double(at.z));
      square += error * error;
      worst = std::max(worst, std::abs(error));
    }
    CHECK(worst <= h * h / 8 * curvature + (N::kIsFixed ? 3.1 : 0.01));
    return std::sqrt(square / kPlaces);
  };
  double coarse = errors(1.0 / 4);
  for (const double h : {1.0 / 8, 1.0 / 16, 1.0 / 32}) {
    const double fine = errors(h);
    const double order = std::log2(coarse / fine);
    CHECK(order >= 1.9);
    CHECK(order <= 2.1);
    coarse = fine;
  }
}

TEST_CASE("the eight weights are never negative, add up to one exactly and are 1.5 steps true") {
  CHECK(rc::check([](std::uint16_t x, std::uint16_t y, std::uint16_t z) {
    const auto cell = cell_at<FixedNumbers>(in_cell(x, y, z));
    const auto weights = trilinear_weights<FixedNumbers>(cell.weight);
    RC_ASSERT(std::accumulate(weights.begin(), weights.end(), 0) == FixedNumbers::kWeightOne);
    const double one = FixedNumbers::kWeightOne;
    const auto exact = trilinear_weights<DoubleNumbers>(
        {cell.weight.x / one, cell.weight.y / one, cell.weight.z / one});
    for (std::size_t c = 0; c < 8; ++c) {
      RC_ASSERT(weights[c] >= 0);
      RC_ASSERT(std::abs(weights[c] - exact[c] * one) <= 1.5);
    }
  }));
}

TEST_CASE("every corner has the same weight in the middle, all of it at a corner") {
  const auto middle = trilinear_weights<FixedNumbers>({16384, 16384, 16384});
  for (const std::int32_t w : middle) CHECK(w == 4096);
  for (std::size_t c = 0; c < 8; ++c) {
    const auto end = [&](std::size_t bit) { return (c >> bit & 1) != 0 ? 32768 : 0; };
    const auto weights = trilinear_weights<FixedNumbers>({end(0), end(1), end(2)});
    for (std::size_t other = 0; other < 8; ++other) {
      CHECK(weights[other] == (other == c ? 32768 : 0));
    }
  }
}

TEST_CASE("a position splits into cell and weight by flooring, below zero too") {
  const auto cell = cell_at<FixedNumbers>({Q16(-0.25), Q16(2.0), Q16::from_raw(3 * 65536 - 1)});
  CHECK(cell.low == VoxelIndex{-1, 2, 2});
  CHECK(cell.weight.x == 24576);
  CHECK(cell.weight.y == 0);
  CHECK(cell.weight.z == 32768);
  const auto real = cell_at<DoubleNumbers>({-0.25, 2.0, 2.75});
  CHECK(real.low == VoxelIndex{-1, 2, 2});
  CHECK(real.weight.x == 0.75);
  CHECK(real.weight.z == 0.75);
}

TEST_CASE_TEMPLATE("a sample beyond the position limit stays at the limit, NaN as well", N,
                   FixedNumbers, DoubleNumbers) {
  ToolPose<N> pose = pose_at<N>({1e9, -1e9, 0.0});
  auto at = sample_position(pose, ToolOffset{});
  CHECK(double(at.x) == kPositionLimitVox);
  CHECK(double(at.y) == -kPositionLimitVox);
  CHECK(double(at.z) == 0.0);
  for (auto& row : pose.step) row.fill(std::numeric_limits<typename N::Step>::max());
  at = sample_position(pose, ToolOffset{32767, 32767, 32767});
  CHECK(double(at.z) == kPositionLimitVox);
  if constexpr (!N::kIsFixed) {
    pose.centre_vox.z = std::numeric_limits<typename N::Real>::quiet_NaN();
    CHECK(sample_position(pose, ToolOffset{}).z == -kPositionLimitVox);
  }
}
