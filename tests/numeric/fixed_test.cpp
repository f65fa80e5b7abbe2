// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

using kerf::Fixed;
using kerf::Q16;
using kerf::Q30;

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
  CHECK(rc::check("sum", [](std::int32_t a, std::int32_t b) {
    RC_ASSERT((Q16::from_raw(a) + Q16::from_raw(b)).raw() == clamp_raw(double(a) + double(b)));
  }));
  CHECK(rc::check("product", [](std::int32_t a, std::int32_t b) {
    const long double exact = static_cast<long double>(a) * b / 65536.0L;
    RC_ASSERT((Q16::from_raw(a) * Q16::from_raw(b)).raw() ==
              clamp_raw(double(std::floor(exact + 0.5L))));
  }));
  CHECK(rc::check("quotient", [](std::int32_t a, std::int32_t b) {
    RC_PRE(b != 0);
    const long double exact = static_cast<long double>(a) * 65536.0L / b;
    RC_ASSERT((Q16::from_raw(a) / Q16::from_raw(b)).raw() ==
              clamp_raw(double(std::floor(exact + 0.5L))));
  }));
}

TEST_CASE("multiply rounds once across formats") {
  CHECK(rc::check([](std::int32_t a, std::int32_t b) {
    const long double exact = static_cast<long double>(a) * b / (1LL << 30);
    RC_ASSERT(kerf::multiply<Q16>(Q30::from_raw(a), Q16::from_raw(b)).raw() ==
              clamp_raw(double(std::floor(exact + 0.5L))));
  }));
}

TEST_CASE("integer square root is exact for every size of argument") {
  CHECK(rc::check([](std::uint64_t v) {
    const std::uint64_t root = kerf::integer_sqrt(v);
    const auto next = static_cast<long double>(root + 1);  // 64-bit mantissa: its square is exact
    RC_ASSERT(root * root <= v);
    RC_ASSERT(next * next > static_cast<long double>(v));
  }));
  CHECK(kerf::integer_sqrt(~std::uint64_t{0}) == 0xffffffffu);
}

TEST_CASE_TEMPLATE("length of a 2-3-6 vector is 7", S, Q16, float, double) {
  const kerf::WorldVec<S> v{S(2.0), S(-3.0), S(6.0)};
  CHECK(double(kerf::norm(v)) == doctest::Approx(7.0).epsilon(1e-5));
  CHECK(double(kerf::dot(v, v)) == doctest::Approx(49.0).epsilon(1e-5));
}

TEST_CASE("length and dot product saturate at the range ends") {
  const auto end = Q16::from_raw(kMin);
  const kerf::WorldVec<Q16> v{end, end, end};
  CHECK(kerf::norm(v).raw() == kMax);
  CHECK(kerf::dot(v, v).raw() == kMax);
  CHECK(kerf::dot(v, -v).raw() == kMin);
}
