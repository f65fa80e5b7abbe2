// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <doctest/doctest.h>

#include "shared/numeric/numbers.hpp"
#include "shared/numeric/statistics.hpp"
#include "shared/numeric/vec.hpp"
#include "tests/support/property.hpp"

namespace kerf::numeric_test {

using namespace kerf::test;

namespace {
constexpr std::int32_t kMin = std::numeric_limits<std::int32_t>::min();
constexpr std::int32_t kMax = std::numeric_limits<std::int32_t>::max();
std::int32_t clamp_raw(double raw) {
  return raw <= kMin ? kMin : raw >= kMax ? kMax : static_cast<std::int32_t>(raw);
}
}  // namespace

TEST_CASE("Fixed rounds half up, for positive and negative values") {
  CHECK(Fixed<1>(0.25).raw() == 1);    // 0.5 steps up to 1
  CHECK(Fixed<1>(-0.25).raw() == 0);   // -0.5 steps up to 0
  CHECK(Fixed<1>(-0.75).raw() == -1);  // -1.5 steps up to -1
  CHECK(Q16(1.0).raw() == 65536);
  CHECK(double(Q16(-2.5)) == -2.5);
  CHECK(Fixed<4>(Fixed<8>::from_raw(8)).raw() == 1);   // half a step up
  CHECK(Fixed<4>(Fixed<8>::from_raw(-8)).raw() == 0);  // half a step up
}

TEST_CASE("Fixed saturates at both ends instead of wrapping") {
  CHECK(Q16(1e9).raw() == kMax);
  CHECK(Q16(-1e9).raw() == kMin);
  CHECK((Q16(30000) + Q16(30000)).raw() == kMax);
  CHECK((Q16(-30000) - Q16(30000)).raw() == kMin);
  CHECK((-Q16::from_raw(kMin)).raw() == kMax);
  CHECK((Q16(-30000) * Q16(30000)).raw() == kMin);
  CHECK((Q16(1) / Q16(0)).raw() == kMax);
  CHECK((Q16(-1) / Q16(0)).raw() == kMin);
  CHECK((Q16(0) / Q16(0)).raw() == 0);
  CHECK((Q16::from_raw(kMin) / Q16::from_raw(-1)).raw() == kMax);
  CHECK(Q16(std::numeric_limits<double>::quiet_NaN()).raw() == 0);
  CHECK(Q16(std::numeric_limits<double>::infinity()).raw() == kMax);
}

TEST_CASE("Fixed arithmetic is the rounded, saturated exact result") {
  CHECK(property([] {
    const auto a = any<std::int32_t>();
    const auto b = any<std::int32_t>();
    HOLDS((Q16::from_raw(a) + Q16::from_raw(b)).raw() == clamp_raw(double(a) + double(b)));
  }));
  CHECK(property([] {
    const auto a = any<std::int32_t>();
    const auto b = any<std::int32_t>();
    const long double exact = static_cast<long double>(a) * b / 65536.0L;
    HOLDS((Q16::from_raw(a) * Q16::from_raw(b)).raw() ==
          clamp_raw(double(std::floor(exact + 0.5L))));
  }));
  CHECK(property([] {
    const auto a = any<std::int32_t>();
    const auto b = any<std::int32_t>();
    if (!(b != 0)) discard();
    const long double exact = static_cast<long double>(a) * 65536.0L / b;
    HOLDS((Q16::from_raw(a) / Q16::from_raw(b)).raw() ==
          clamp_raw(double(std::floor(exact + 0.5L))));
  }));
}

TEST_CASE("multiply rounds once across formats") {
  CHECK(property([] {
    const auto a = any<std::int32_t>();
    const auto b = any<std::int32_t>();
    const long double exact = static_cast<long double>(a) * b / (1LL << 30);
    HOLDS(multiply<Q16>(Q30::from_raw(a), Q16::from_raw(b)).raw() ==
          clamp_raw(double(std::floor(exact + 0.5L))));
  }));
}

TEST_CASE("integer square root is exact for every size of argument") {
  CHECK(property([] {
    const auto v = any<std::uint64_t>();
    const std::uint64_t root = integer_sqrt(v);
    const auto next = static_cast<long double>(root + 1);  // 64-bit mantissa: its square is exact
    HOLDS(root * root <= v);
    HOLDS(next * next > static_cast<long double>(v));
  }));
  CHECK(integer_sqrt(~std::uint64_t{0}) == 0xffffffffu);
}

TEST_CASE_TEMPLATE("length of a 2-3-6 vector is 7", S, Q16, float, double) {
  const WorldVec<S> v{S(2.0), S(-3.0), S(6.0)};
  CHECK(double(norm(v)) == doctest::Approx(7.0).epsilon(1e-5));
  CHECK(double(dot(v, v)) == doctest::Approx(49.0).epsilon(1e-5));
}

TEST_CASE("length and dot product saturate at the range ends") {
  const auto end = Q16::from_raw(kMin);
  const WorldVec<Q16> v{end, end, end};
  CHECK(norm(v).raw() == kMax);
  CHECK(dot(v, v).raw() == kMax);
  CHECK(dot(v, -v).raw() == kMin);
}

TEST_CASE("percentiles are at most one bucket (3.2 %) above the exact ones, the maximum is exact") {
  CHECK(property([] {
    std::vector<std::int64_t> values(in_range<std::size_t>(1, 100));
    for (auto& v : values) v = in_range<std::int64_t>(0, 1LL << 40);
    Histogram histogram;
    for (const auto v : values) histogram.record(v);
    auto sorted = values;
    std::ranges::sort(sorted);
    for (const double q : {0.5, 0.99, 0.999}) {
      const auto rank = static_cast<std::size_t>(
          std::max(0.0, std::ceil(q * static_cast<double>(sorted.size())) - 1));
      const double exact_us = static_cast<double>(sorted[rank]) / 1e3;
      HOLDS(histogram.percentile_us(q) >= exact_us);
      HOLDS(histogram.percentile_us(q) <= exact_us * 1.032 + 1e-3);
    }
    HOLDS(histogram.max_us() == static_cast<double>(sorted.back()) / 1e3);
    HOLDS(histogram.count() == values.size());
  }));
}

TEST_CASE("an empty histogram reads zero and a negative duration counts as zero") {
  Histogram histogram;
  CHECK(histogram.percentile_us(0.99) == 0);
  histogram.record(-5);
  CHECK(histogram.count() == 1);
  CHECK(histogram.max_us() == 0);
}

TEST_CASE("a percentile is the smallest value that so large a share does not exceed") {
  CHECK(property([] {
    std::vector<double> values(in_range<std::size_t>(1, 100));
    for (double& v : values) v = in_range(0, 1000) * 0.1;
    const double share = in_range(1, 101) * 0.01;
    const double found = percentile(values, share);
    const auto below = [&](double limit) {
      return static_cast<double>(
          std::count_if(values.begin(), values.end(), [&](double v) { return v <= limit; }));
    };
    const double needed = share * static_cast<double>(values.size());
    HOLDS(below(found) >= needed - 1e-9);
    for (const double v : values) HOLDS(v >= found || below(v) < needed - 1e-12);
  }));
  CHECK(percentile({}, 0.5) == 0.0);
}

}  // namespace kerf::numeric_test
