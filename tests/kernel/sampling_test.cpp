// SPDX-License-Identifier: Apache-2.0
// Every rounding of the fixed kernels against exact rational arithmetic: to the nearest, ties up.
// Fast paths share these functions with the definitions that they are compared with, so a wrong
// half would move both alike and nothing but a test of the function itself could see it.
#include "controller/kernel/sampling.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include <doctest/doctest.h>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/milling.hpp"
#include "controller/kernel/overlap.hpp"
#include "shared/numeric/numbers.hpp"
#include "tests/kernel/support.hpp"
#include "tests/support/property.hpp"

namespace kerf::sampling_test {

using namespace kerf::test;

namespace {

__extension__ using Int128 = __int128;

/// `value` is `exact` / 2^bits to the nearest, ties up: -1/2 < value - exact / 2^bits <= 1/2.
bool is_nearest(std::int64_t value, Int128 exact, int bits) {
  const Int128 twice = 2 * (Int128{value} * (Int128{1} << bits) - exact);
  const Int128 one = Int128{1} << bits;
  return -one < twice && twice <= one;
}

/// Weights that matter most, and some between.
std::vector<std::int32_t> some_weights() {
  std::vector<std::int32_t> weights{0, 1, 2, 3, 16383, 16384, 16385, 32766, 32767, 32768};
  for (std::int32_t w = 5; w < 32768; w += 211) weights.push_back(w);
  return weights;
}

}  // namespace

TEST_CASE("the product of two weights is the nearest weight, ties up") {
  std::int64_t wrong = 0, ties = 0;
  for (const std::int32_t b : some_weights()) {
    for (std::int32_t a = 0; a <= FixedNumbers::kWeightOne; ++a) {
      const std::int64_t exact = std::int64_t{a} * b;
      wrong += is_nearest(weight_product<FixedNumbers>(a, b), exact, 15) ? 0 : 1;
      ties += exact % 32768 == 16384 ? 1 : 0;
    }
  }
  CHECK(wrong == 0);
  CHECK(ties > 0);
}

TEST_CASE("each of the eight weights is one rounded product or the rest of what it splits") {
  std::int64_t wrong = 0;
  for (const std::int32_t wy : some_weights()) {
    for (const std::int32_t wz : some_weights()) {
      for (const std::int32_t wx : {0, 1, 4321, 16384, 16385, 29999, 32767, 32768}) {
        const auto w = trilinear_weights<FixedNumbers>({wx, wy, wz});
        const std::int64_t edge[4] = {w[0] + w[1], w[2] + w[3], w[4] + w[5], w[6] + w[7]};
        bool right = is_nearest(edge[3], std::int64_t{wy} * wz, 15);
        right = right && edge[1] + edge[3] == wy && edge[2] + edge[3] == wz;
        right = right && edge[0] + edge[1] + edge[2] + edge[3] == FixedNumbers::kWeightOne;
        for (std::size_t q = 0; q < 4; ++q) {
          right = right && w[2 * q] >= 0 && is_nearest(w[2 * q + 1], wx * edge[q], 15);
        }
        wrong += right ? 0 : 1;
      }
    }
  }
  CHECK(wrong == 0);
}

TEST_CASE("every fraction of a position becomes the nearest weight, in every cell") {
  std::int64_t wrong = 0;
  for (const std::int32_t cell : {-16384, -2, -1, 0, 1, 255, 16383}) {
    for (std::int32_t fraction = 0; fraction < 65536; ++fraction) {
      const Q16 at = Q16::from_raw(cell * 65536 + fraction);
      const Cell<FixedNumbers> found = cell_at<FixedNumbers>({at, at, at});
      const bool right = found.low == VoxelIndex{cell, cell, cell} &&
                         is_nearest(found.weight.x, fraction, 1) &&
                         found.weight.y == found.weight.x && found.weight.z == found.weight.x;
      wrong += right ? 0 : 1;
    }
  }
  CHECK(wrong == 0);
}

TEST_CASE("a lerp is the nearest value between its ends, ties up, in 32 and in 64 bits") {
  std::mt19937_64 random(3);
  std::int64_t wrong = 0;
  for (int n = 0; n < 200'000; ++n) {
    const auto w = static_cast<std::int32_t>(n % 5 == 0 ? random() % 3 * 16384 : random() % 32769);
    const auto exact = [&](std::int64_t a, std::int64_t b) {
      return Int128{a} * (32768 - w) + Int128{b} * w;
    };
    const std::int32_t a = static_cast<std::int16_t>(random()) * FixedNumbers::kSampleOne;
    const std::int32_t b = static_cast<std::int16_t>(random()) * FixedNumbers::kSampleOne;
    wrong += is_nearest(lerp<FixedNumbers>(a, b, w), exact(a, b), 15) ? 0 : 1;
    const auto c = static_cast<std::int64_t>(random()) >> 18;  // |b - a| < 2^47
    const auto d = static_cast<std::int64_t>(random()) >> 18;
    wrong += is_nearest(lerp<FixedNumbers>(c, d, w), exact(c, d), 15) ? 0 : 1;
  }
  CHECK(wrong == 0);
}

TEST_CASE("three lerps go along x, then y, then z, each rounded on its own") {
  std::mt19937 random(4);
  std::int64_t wrong = 0;
  for (int n = 0; n < 20'000; ++n) {
    std::array<std::int32_t, 8> value{};
    for (auto& v : value) v = static_cast<std::int16_t>(random()) * FixedNumbers::kSampleOne;
    const std::array<std::int32_t, 3> w{static_cast<std::int32_t>(random() % 32769),
                                        static_cast<std::int32_t>(random() % 32769),
                                        static_cast<std::int32_t>(random() % 32769)};
    const std::int32_t result = trilinear<FixedNumbers>(value, {w[0], w[1], w[2]});
    for (std::size_t axis = 0, left = 8; axis < 3; ++axis) {
      left /= 2;
      for (std::size_t i = 0; i < left; ++i) {
        const std::int64_t exact = std::int64_t{value[2 * i]} * (32768 - w[axis]) +
                                   std::int64_t{value[2 * i + 1]} * w[axis];
        std::int64_t nearest = exact / 32768 - 1;
        while (nearest * 32768 + 16384 <= exact) ++nearest;
        value[i] = static_cast<std::int32_t>(nearest);
      }
    }
    wrong += result == value[0] ? 0 : 1;
  }
  CHECK(wrong == 0);
}

TEST_CASE("a sample's position is the nearest step to the exact one, ties up") {
  std::mt19937 random(5);
  std::int64_t wrong = 0;
  for (int n = 0; n < 100'000; ++n) {
    ToolPose<FixedNumbers> pose;
    const auto centre = static_cast<std::int32_t>(random() % 40'000'000);
    pose.centre_vox = {Q16::from_raw(centre), Q16::from_raw(-centre), Q16::from_raw(centre / 2)};
    ToolOffset offset{};
    for (auto& o : offset) o = static_cast<std::int16_t>(static_cast<int>(random() % 129) - 64);
    for (auto& row : pose.step) {
      for (auto& s : row) s = static_cast<std::int32_t>(random() % (1u << 21)) - (1 << 20);
    }
    const auto at = sample_position(pose, offset);
    const std::int32_t place[3] = {at.x.raw(), at.y.raw(), at.z.raw()};
    const std::int32_t start[3] = {centre, -centre, centre / 2};
    for (std::size_t a = 0; a < 3; ++a) {
      std::int64_t exact = std::int64_t{start[a]} * 32;  // half pitches of 2^-20: 2^-21 of a voxel
      for (std::size_t b = 0; b < 3; ++b) exact += std::int64_t{pose.step[a][b]} * offset[b];
      wrong += is_nearest(place[a], exact, 5) ? 0 : 1;
    }
  }
  CHECK(wrong == 0);
}

TEST_CASE("gradients are rounded once, stored ones to a step and summed ones to 1/256") {
  std::mt19937_64 random(6);
  std::int64_t wrong = 0;
  for (int n = 0; n < 100'000; ++n) {
    const auto stored = static_cast<std::int64_t>(random() % (std::uint64_t{50'000} << 21)) -
                        (std::int64_t{25'000} << 21);
    wrong += is_nearest(gradient_from_sum<FixedNumbers>(stored, 21), stored, 21) ? 0 : 1;
    const std::int64_t tie = stored - (stored & 0x1fffff) + (1 << 20);
    wrong += is_nearest(gradient_from_sum<FixedNumbers>(tie, 21), tie, 21) ? 0 : 1;
    const auto sum = static_cast<std::int64_t>(random()) >> 16;  // 2^47, the bound of a 64 cube
    for (const ExactTaps& taps : {kExactFarid, kExactSobel5, kExactCentral}) {
      wrong += is_nearest(kept_bits(taps, sum), Int128{taps.factor} * sum, taps.shift - 8) ? 0 : 1;
    }
  }
  CHECK(wrong == 0);
}

TEST_CASE("a scaled overlap is the nearest weight, at most one") {
  std::mt19937 random(7);
  std::int64_t wrong = 0;
  for (int n = 0; n < 100'000; ++n) {
    const auto sum = static_cast<std::int32_t>(random() % 4'000'000);
    const auto scale = static_cast<std::int32_t>(1 + random() % (1u << 22));
    const std::int32_t ratio = detail::overlap_ratio<FixedNumbers>(sum, scale);
    const bool whole = Int128{sum} * scale > Int128{32768} << 20;
    wrong += (whole ? ratio == 32768 : is_nearest(ratio, Int128{sum} * scale, 20)) ? 0 : 1;
  }
  CHECK(wrong == 0);
}

TEST_CASE("the bent overlap is the nearest weight between two entries of its table") {
  std::int64_t wrong = 0;
  for (const double kt : {0.01, 0.7, 3.0, 42.0}) {
    const auto rate = removal_rate<FixedNumbers>(kt, true);
    for (std::int32_t ratio = 0; ratio < FixedNumbers::kWeightOne; ++ratio) {
      const auto i = static_cast<std::size_t>(ratio / 128);
      const std::int64_t exact =
          std::int64_t{rate.bend[i]} * (128 - ratio % 128) + rate.bend[i + 1] * (ratio % 128);
      wrong += is_nearest(bent_ratio(rate, ratio), exact, 7) ? 0 : 1;
    }
    CHECK(bent_ratio(rate, FixedNumbers::kWeightOne) == FixedNumbers::kWeightOne);
  }
  CHECK(wrong == 0);
}

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

}  // namespace kerf::sampling_test
