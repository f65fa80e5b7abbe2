// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

// Elementary functions whose bits are the same on every machine, as elementary.hpp, for what is
// computed in each step of an emulated device's mechanics: in plain double, so that they are as
// fast as the C library's, and within 4 units in the last place, sine and cosine within 2e-16. They
// use + - * /, sqrt and rounding to a whole number, which IEEE 754 fixes. Arguments are finite.

namespace kerf::quick {

/// 1 / (n (n + step)) for n = first, first + 2, ...: the ratios of a Taylor series' terms.
template <int kFirst, int kStep>
inline constexpr auto kRatios = [] {
  std::array<double, 8> ratios{};
  for (int i = 0; i < 8; ++i) {
    const int n = kFirst + 2 * i;
    ratios[static_cast<std::size_t>(i)] = 1.0 / (n * (n + kStep));
  }
  return ratios;
}();

/// Of an angle within +-pi/4: Taylor series up to x^17 and x^16, whose next terms are below 1e-19
/// and 1e-18.
[[nodiscard]] constexpr double short_sine(double x) noexcept {
  const double s = x * x;
  double sum = 1;
  for (std::size_t i = 8; i-- > 1;) sum = 1 - s * kRatios<2, 1>[i] * sum;
  return x - x * s * kRatios<2, 1>[0] * sum;
}
[[nodiscard]] constexpr double short_cosine(double x) noexcept {
  const double s = x * x;
  double sum = 1;
  for (std::size_t i = 8; i-- > 1;) sum = 1 - s * kRatios<2, -1>[i] * sum;
  return 1 - s * kRatios<2, -1>[0] * sum;
}

struct Quarter {
  double rest;        ///< within +-pi/4
  std::int64_t turn;  ///< quarter turns that were taken off
};
/// Of an angle up to 2^20 quarter turns: pi/2 in three parts, of which the first two have 33 bits.
[[nodiscard]] inline Quarter quarter_of(double angle) noexcept {
  const double turns = std::nearbyint(angle * (2 / std::numbers::pi));
  const double rest = ((angle - turns * 1.5707963267341256) - turns * 6.077100506303966e-11) -
                      turns * 2.0222662487959506e-21;
  return {rest, static_cast<std::int64_t>(turns)};
}

[[nodiscard]] inline double sine(double angle) noexcept {
  const auto [rest, turn] = quarter_of(angle);
  const double value = turn % 2 == 0 ? short_sine(rest) : short_cosine(rest);
  return (turn & 2) == 0 ? value : -value;
}
[[nodiscard]] inline double cosine(double angle) noexcept {
  const auto [rest, turn] = quarter_of(angle);
  const double value = turn % 2 == 0 ? short_cosine(rest) : short_sine(rest);
  return ((turn + 1) & 2) == 0 ? value : -value;
}

/// The angle of (x, y), in -pi .. pi; 0 for (0, 0). The slope's nearest sixteenth has its arc in a
/// table, and the rest, at most 1/32, a series up to x^11.
[[nodiscard]] inline double arctangent(double y, double x) noexcept {
  constexpr std::array kArcs = {
      0.0,
      0.06241880999595735,
      0.12435499454676144,
      0.18534794999569476,
      0.24497866312686414,
      0.3028848683749714,
      0.35877067027057225,
      0.4124104415973873,
      0.4636476090008061,
      0.5123894603107377,
      0.5585993153435624,
      0.6022873461349642,
      0.6435011087932844,
      0.6823165548747481,
      0.7188299996216245,
      0.7531512809621944,
      0.7853981633974483,
  };
  const double ax = std::abs(x), ay = std::abs(y);
  if (ax == 0 && ay == 0) return 0;
  const bool steep = ay > ax;
  const double slope = steep ? ax / ay : ay / ax;
  const double sixteenth = std::nearbyint(slope * 16);
  const double from = sixteenth / 16;
  const double t = (slope - from) / (1 + slope * from), s = t * t;
  const double series =
      t - t * s * (1.0 / 3 - s * (1.0 / 5 - s * (1.0 / 7 - s * (1.0 / 9 - s / 11))));
  double angle = kArcs[static_cast<std::size_t>(sixteenth)] + series;
  if (steep) angle = std::numbers::pi / 2 - angle;
  if (x < 0) angle = std::numbers::pi - angle;
  return y < 0 ? -angle : angle;
}

/// Of -1 .. 1; in 0 .. pi.
[[nodiscard]] inline double arccosine(double cosine) noexcept {
  return arctangent(std::sqrt((1 - cosine) * (1 + cosine)), cosine);
}

/// e^x - 1 for x within +-0.35: Taylor series up to x^14, whose next term is below 2e-19.
[[nodiscard]] constexpr double short_growth(double x) noexcept {
  double sum = 1;
  for (int n = 14; n >= 2; --n) sum = 1 + x / n * sum;
  return x * sum;
}

/// e^x, 0 where it is below the least normal number; infinite where it is above the largest.
[[nodiscard]] inline double exponential(double x) noexcept {
  constexpr double kLeast = -708, kMost = 709;
  if (x < kLeast) return 0;
  if (x > kMost) return std::bit_cast<double>(std::uint64_t{0x7ff} << 52);
  const double powers = std::nearbyint(x * (1 / std::numbers::ln2));
  const double rest = (x - powers * 0.6931471803691238) - powers * 1.9082149292705877e-10;
  const auto exponent = static_cast<std::uint64_t>(static_cast<std::int64_t>(powers) + 1023);
  return (1 + short_growth(rest)) * std::bit_cast<double>(exponent << 52);
}

/// e^x - 1, also for small x.
[[nodiscard]] inline double growth(double x) noexcept {
  return std::abs(x) < 0.35 ? short_growth(x) : exponential(x) - 1;
}

/// Of x >= 0. Newton's method from a third of the exponent.
[[nodiscard]] inline double cube_root(double x) noexcept {
  if (!(x > 0)) return 0;
  double root = std::bit_cast<double>(std::bit_cast<std::uint64_t>(x) / 3 +
                                      (std::uint64_t{0x2a9f'7893} << 32));
  for (int step = 0; step < 5; ++step) root -= (root - x / (root * root)) / 3;
  return root;
}

}  // namespace kerf::quick
