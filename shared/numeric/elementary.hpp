// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

// Elementary functions for load time, whose bits are the same on every machine: the C library's
// last bit changes between libraries and versions, and a tool's samples with it. They use + - * /
// and sqrt alone, which IEEE 754 rounds correctly. Where a double would lose digits they compute in
// double-double (Dekker, "A floating-point technique for extending the available precision", 1971),
// so that a result is within 0.51 units in the last place.
//
// Arguments are finite. About 0.1 us for sine and cosine, 0.5 us for an arc.

namespace kerf {

/// An unevaluated sum: `low` is at most half a unit in the last place of `high`.
struct DoubleDouble {
  double high = 0, low = 0;
};

namespace elementary {

/// a + b, exactly.
[[nodiscard]] constexpr DoubleDouble two_sum(double a, double b) noexcept {
  const double sum = a + b, part = sum - a;
  return {sum, (a - (sum - part)) + (b - part)};
}

/// a * b, exactly, if no half of it underflows.
[[nodiscard]] constexpr DoubleDouble two_product(double a, double b) noexcept {
  constexpr double kSplit = 134217729;  // 2^27 + 1
  const double wide_a = kSplit * a, wide_b = kSplit * b;
  const double high_a = wide_a - (wide_a - a), high_b = wide_b - (wide_b - b);
  const double low_a = a - high_a, low_b = b - high_b;
  const double product = a * b;
  return {product, ((high_a * high_b - product) + high_a * low_b + low_a * high_b) + low_a * low_b};
}

[[nodiscard]] constexpr DoubleDouble operator+(DoubleDouble a, DoubleDouble b) noexcept {
  const DoubleDouble high = two_sum(a.high, b.high), low = two_sum(a.low, b.low);
  const DoubleDouble sum = two_sum(high.high, high.low + low.high);
  return two_sum(sum.high, sum.low + low.low);
}
[[nodiscard]] constexpr DoubleDouble operator-(DoubleDouble a) noexcept {
  return {-a.high, -a.low};
}
[[nodiscard]] constexpr DoubleDouble operator-(DoubleDouble a, DoubleDouble b) noexcept {
  return a + -b;
}
[[nodiscard]] constexpr DoubleDouble operator*(DoubleDouble a, DoubleDouble b) noexcept {
  const DoubleDouble product = two_product(a.high, b.high);
  return two_sum(product.high, product.low + (a.high * b.low + a.low * b.high));
}
[[nodiscard]] constexpr DoubleDouble operator/(DoubleDouble a, DoubleDouble b) noexcept {
  const double first = a.high / b.high;
  const DoubleDouble rest = a - b * DoubleDouble{first};
  const double second = rest.high / b.high;
  const DoubleDouble last = rest - b * DoubleDouble{second};
  return two_sum(first, second) + DoubleDouble{last.high / b.high};
}
[[nodiscard]] inline DoubleDouble square_root(DoubleDouble a) noexcept {
  if (a.high <= 0) return {};
  const double root = std::sqrt(a.high);
  const DoubleDouble rest = a - two_product(root, root);
  return two_sum(root, rest.high / (2 * root));
}

/// pi / 2 in four parts; the first three have 33 bits, so that k times them is exact up to k =
/// 2^20.
inline constexpr std::array<double, 4> kHalfPi = {1.5707963267341256, 6.077100506303966e-11,
                                                  2.0222662487111665e-21, 8.4784276603689e-32};

struct SineCosine {
  DoubleDouble sine, cosine;
};

/// Of an angle within +-pi/4, by its Taylor series: the first terms in double-double, and in double
/// the rest, which is at most 2^-8 of the sine and 2^-11 of the cosine.
[[nodiscard]] constexpr SineCosine series(DoubleDouble angle) noexcept {
  constexpr int kLast = 22;  // (pi/4)^23 / 23! < 2^-82
  const DoubleDouble square = angle * angle, cube = angle * square, fourth = square * square;
  double odd = 1, even = 1;  // from x^5 / 5! and from x^6 / 6! on, over these
  for (int n = kLast; n >= 8; n -= 2) {
    odd = 1 - odd * square.high / (n * (n + 1));
    even = 1 - even * square.high / (n * (n - 1));
  }
  odd = 1 - odd * square.high / (6 * 7);
  constexpr DoubleDouble kSixth = DoubleDouble{1} / DoubleDouble{6};
  constexpr DoubleDouble kTwentyFourth = DoubleDouble{1} / DoubleDouble{24};
  const double fifth = cube.high * square.high / 120 * odd;
  const double sixth = fourth.high * square.high / 720 * even;
  const DoubleDouble half_square{square.high / 2, square.low / 2};
  return {angle - cube * kSixth + DoubleDouble{fifth},
          DoubleDouble{1} - half_square + (fourth * kTwentyFourth - DoubleDouble{sixth})};
}

/// Of any angle up to 2^20 quarter turns, in either direction.
[[nodiscard]] inline SineCosine sine_cosine(DoubleDouble angle) noexcept {
  const double quarters = std::nearbyint(angle.high / (std::numbers::pi / 2));
  DoubleDouble rest = angle;
  for (const double part : kHalfPi) rest = rest - two_product(quarters, part);
  const SineCosine at = series(rest);
  switch (static_cast<std::int64_t>(quarters) & 3) {
    case 0:
      return at;
    case 1:
      return {at.cosine, -at.sine};
    case 2:
      return {-at.sine, -at.cosine};
    default:
      return {-at.cosine, at.sine};
  }
}

/// The angle of (x, y), in -pi .. pi; 0 for the origin. Two steps of Newton's method: a is wrong by
/// t with tan t = (y cos a - x sin a) / (x cos a + y sin a), of which the series to t^5 is taken.
[[nodiscard]] inline DoubleDouble arc(DoubleDouble y, DoubleDouble x) noexcept {
  if (y.high == 0 && x.high == 0) return {};
  const double ax = std::abs(x.high), ay = std::abs(y.high);
  const double slope = ay < ax ? ay / ax : ax / ay;
  double first = slope / (1 + 0.28125 * slope * slope);  // within 0.005 of the arctangent
  if (ay >= ax) first = std::numbers::pi / 2 - first;
  if (x.high < 0) first = std::numbers::pi - first;
  if (y.high < 0) first = -first;
  DoubleDouble angle{first};
  for (int step = 0; step < 2; ++step) {
    const auto [sine, cosine] = sine_cosine(angle);
    const DoubleDouble tangent = (y * cosine - x * sine) / (x * cosine + y * sine);
    const DoubleDouble square = tangent * tangent;
    const DoubleDouble more =
        square * (DoubleDouble{1.0 / 5} * square - DoubleDouble{1} / DoubleDouble{3});
    angle = angle + tangent + tangent * more;
  }
  return angle;
}

}  // namespace elementary

/// `angle` in radians, up to 2^20 quarter turns.
[[nodiscard]] inline double sine(double angle) noexcept {
  return elementary::sine_cosine({angle}).sine.high;
}
[[nodiscard]] inline double cosine(double angle) noexcept {
  return elementary::sine_cosine({angle}).cosine.high;
}

/// Both, for the cost of one.
struct CirclePoint {
  double cosine, sine;
};
[[nodiscard]] inline CirclePoint on_circle(double angle) noexcept {
  const elementary::SineCosine at = elementary::sine_cosine({angle});
  return {at.cosine.high, at.sine.high};
}

/// In -pi .. pi; 0 for (0, 0).
[[nodiscard]] inline double arctangent(double y, double x) noexcept {
  return elementary::arc({y}, {x}).high;
}

/// Of -1 .. 1; in 0 .. pi.
[[nodiscard]] inline double arccosine(double cosine) noexcept {
  using elementary::operator-;
  const DoubleDouble square = elementary::two_product(cosine, cosine);
  return elementary::arc(elementary::square_root(DoubleDouble{1} - square), {cosine}).high;
}

/// Length of (x, y), and of (x, y, z). Squares must neither overflow nor underflow.
[[nodiscard]] inline double hypotenuse(double x, double y, double z = 0) noexcept {
  return std::sqrt(x * x + y * y + z * z);
}

/// base^exponent for base > 0, exponent within +-4 and a result within 2^+-500: within 1e-14 of it,
/// relatively. 0 for a base that is not positive.
[[nodiscard]] constexpr double power(double base, double exponent) noexcept {
  if (!(base > 0)) return 0;
  int octaves = 0;
  for (; base > 1.5; base /= 2) ++octaves;
  for (; base < 0.75; base *= 2) --octaves;
  // ln base = 2 artanh z, |z| <= 0.2; the series ends below 1e-17.
  const double z = (base - 1) / (base + 1), square = z * z;
  double ln_half = 0, odd = z;
  for (int n = 1; n < 24; n += 2, odd *= square) ln_half += odd / n;
  const double ln = exponent * (octaves * std::numbers::ln2 + 2 * ln_half);
  // exp of what is left of whole octaves, at most ln 2 / 2.
  const double wanted = ln / std::numbers::ln2;
  const auto whole = static_cast<int>(wanted < 0 ? wanted - 0.5 : wanted + 0.5);
  const double rest = ln - whole * std::numbers::ln2;
  double result = 1, term = 1;
  for (int n = 1; n < 18; ++n) {
    term *= rest / n;
    result += term;
  }
  for (int i = 0; i < whole; ++i) result *= 2;
  for (int i = 0; i > whole; --i) result /= 2;
  return result;
}

/// 10^-digits, the nearest double up to 22 digits; 0 from 309 on. `digits` may be negative.
[[nodiscard]] constexpr double power_of_tenth(int digits) noexcept {
  constexpr int kOverflow = 309;
  const int count = std::clamp(digits, -kOverflow, kOverflow);
  double power = 1;
  for (int i = count < 0 ? -count : count; i > 0; --i) power *= 10;
  return digits < 0 ? power : 1 / power;
}

}  // namespace kerf
