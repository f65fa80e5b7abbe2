// SPDX-License-Identifier: Apache-2.0
// How press, speed and wear of a bur become removal.
#include "controller/kernel/cut_law.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <doctest/doctest.h>

#include "tests/kernel/preston_support.hpp"

namespace kerf::cut_law_test {

using namespace kerf::test;

namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::array<double, 3> kCentre{16.3, 15.8, 16.1};

/// By the C library and in double: a second way to the same numbers.
double drive_by_libm(const CutLawFigures& law, double force_n, double ratio, double worn_n_s) {
  const double press_n = law.largest_n > 0 ? std::min(force_n, law.largest_n) : force_n;
  if (press_n <= law.threshold_n || ratio <= 0) return 0;
  const double force =
      law.reference_n * std::pow((press_n - law.threshold_n) / law.reference_n, law.force_exponent);
  const double foot = 1.0 / (1 << kSpeedFootBits);
  const double speed = law.speed_exponent < 1 && ratio < foot
                           ? ratio * std::pow(foot, law.speed_exponent - 1)
                           : std::pow(ratio, law.speed_exponent);
  const double sharp = law.wear_half_n_s > 0 ? 1 / (1 + worn_n_s / law.wear_half_n_s) : 1;
  return force * speed * sharp;
}

template <class N>
double newtons(typename N::Sum drive) {
  return N::kIsFixed ? std::ldexp(double(drive), -kBudgetBits) : double(drive);
}

const std::vector<CutLawFigures> kLaws = {
    {.speed_exponent = 0, .largest_n = 0.98, .wear_half_n_s = 2},
    {.threshold_n = 0.0625, .force_exponent = 0.5, .speed_exponent = 0.29},
    {.threshold_n = 0.0625, .force_exponent = 1.5, .speed_exponent = 1, .wear_half_n_s = 0.5},
    {.reference_n = 0.5, .force_exponent = 2, .speed_exponent = 2, .largest_n = 1.25},
    {.force_exponent = 0.1, .speed_exponent = 0},
};

}  // namespace

TEST_CASE("a power in fixed point is within its bound of the C library's, rises and saturates") {
  constexpr double kOne = 1 << 24;
  constexpr std::int64_t kLargest = (std::int64_t{1} << 31) - 1;
  for (const double exponent : {0.0, 0.1, 0.29, 0.5, 0.71, 1.0, 1.5, 2.0}) {
    for (const double one : {kOne, 0.3 * kOne}) {
      CAPTURE(exponent);
      const PowerLaw<FixedNumbers> fixed(exponent, one, 0, kLargest);
      const PowerLaw<DoubleNumbers> wide(exponent, one, 0, kLargest);
      const double bound = std::abs(exponent * (exponent - 1)) / (1 << 17) + 1e-8;
      std::int64_t last = 0;
      bool rises = true;
      double worst = 0, worst_double = 0;
      for (double x = 1; x < 4e9; x = std::max(x + 1, std::floor(x * 1.003))) {
        const std::int64_t y = fixed.of(static_cast<std::int64_t>(x));
        const double exact = one * std::pow(x / one, exponent);
        rises = rises && y >= last;
        last = y;
        worst_double = std::max(worst_double, std::abs(wide.of(x) / exact - 1));
        const double kept = exponent == 1 ? exact : std::min(exact, double(kLargest));
        worst = std::max(worst, (std::abs(double(y) - kept) - 1) / kept);
      }
      CHECK(rises);
      CHECK(worst < bound);
      CHECK(worst_double < 1e-13);
      CHECK(fixed.of(0) == 0);
    }
  }
}

TEST_CASE("without exponents, saturation and wear the law is Preston's, to the bit") {
  const auto law = cut_law<FixedNumbers>({.threshold_n = 0.05}, 1000);
  std::mt19937 random(5);
  bool same = true;
  for (int i = 0; i < 100'000; ++i) {
    const auto force = Q16::from_raw(static_cast<std::int32_t>(random() >> (1 + random() % 14)));
    const auto ratio = Q30::from_raw(static_cast<std::int32_t>(random() >> (1 + random() % 20)));
    const std::int64_t above =
        std::clamp<std::int64_t>(force.raw() - Q16(0.05).raw(), 0, std::int64_t{64} << 16);
    const std::int64_t preston = std::min<std::int64_t>(round_shift(above * ratio.raw(), 22),
                                                        std::numeric_limits<std::int32_t>::max());
    const std::int64_t drive = cut_drive(law, force, ratio);
    same = same && drive == preston && BurWear<FixedNumbers>{}.left_of(drive, law) == drive;
  }
  CHECK(same);
}

TEST_CASE_TEMPLATE("a bur removes the integral of its law, at every rate and voxel size", N,
                   FixedNumbers, DoubleNumbers) {
  for (const CutLawFigures& figures : kLaws) {
    for (const auto& [voxel_mm, rate_hz] : {std::array{0.125, 250.0}, std::array{0.125, 1000.0},
                                            std::array{0.05, 1000.0}, std::array{0.25, 8000.0}}) {
      CAPTURE(figures.force_exponent);
      CAPTURE(voxel_mm);
      CAPTURE(rate_hz);
      PrestonRig<N> rig(filled({32, 32, 32}, 65535), odd_ball(6), 6, {voxel_mm, 1 / rate_hz});
      rig.law = cut_law<N>(figures, rate_hz);
      rig.threshold_n = figures.threshold_n;
      constexpr double kSeconds = 1;
      double fed = 0, removed = 0, worn_n_s = 0;
      for (int i = 0; i < int(kSeconds * rate_hz); ++i) {
        const double phase = 2 * kPi * (i + 0.5) / (kSeconds * rate_hz);
        const double force_n = std::floor((1 - std::cos(phase)) * 65536) / 65536;
        const double ratio = 0.75 + 0.25 * std::cos(3 * phase);
        const auto out = rig.press(kCentre, force_n, ratio);
        fed += rig.scale.steps_per_n(kEnamelG) * drive_by_libm(figures, force_n, ratio, worn_n_s);
        worn_n_s += drive_by_libm(figures, force_n, ratio, 0) / rate_hz;
        removed += double(out.removed.density_steps);
        CHECK(out.lost == 0);
      }
      double carried = 0;
      for (const auto carry : rig.state.carry) carried += steps_of<N>(carry);
      // Fixed: two powers by tables, each within 2 / 2^17.
      CHECK(removed + carried == doctest::Approx(fed).epsilon(N::kIsFixed ? 3e-5 : 1e-6));
      CHECK(std::abs(carried) < 100);
    }
  }
}

TEST_CASE("the same bur removes the same at 250 Hz to 8 kHz, worn or not") {
  for (const CutLawFigures& figures : kLaws) {
    std::array<double, 2> mm3{};
    for (std::size_t k = 0; k < mm3.size(); ++k) {
      const double rate_hz = std::array{250.0, 8000.0}[k];
      const auto law = cut_law<FixedNumbers>(figures, rate_hz);
      BurWear<FixedNumbers> wear;
      for (int i = 0; i < 4 * int(rate_hz); ++i) {
        const double force_n = 1 - std::cos(kPi * (i + 0.5) / rate_hz);
        const auto sharp = cut_drive(law, Q16(force_n), Q30(0.9));
        mm3[k] += newtons<FixedNumbers>(wear.left_of(sharp, law)) / rate_hz;
        wear.add(sharp);
      }
    }
    CHECK(mm3[0] == doctest::Approx(mm3[1]).epsilon(0.002));
  }
}

TEST_CASE_TEMPLATE("the rate halves with the load-time of the law, and again with the same volume",
                   N, FixedNumbers, DoubleNumbers) {
  constexpr double kHalfNS = 3, kRateHz = 1000;
  const auto law = cut_law<N>({.wear_half_n_s = kHalfNS}, kRateHz);
  BurWear<N> wear;
  const auto sharp = cut_drive<N>(law, typename N::Real(1.5), typename N::Unit(1));
  const auto spend = [&](double seconds) {
    double volume = 0;
    for (int i = 0; i < int(seconds * kRateHz); ++i) {
      volume += newtons<N>(wear.left_of(sharp, law)) / kRateHz;
      wear.add(sharp);
    }
    return volume;
  };
  const auto rate = [&] { return newtons<N>(wear.left_of(sharp, law)) / newtons<N>(sharp); };
  CHECK(rate() == 1);
  const double first = spend(kHalfNS / 1.5);
  CHECK(rate() == doctest::Approx(0.5).epsilon(1e-6));
  const double second = spend(2 * kHalfNS / 1.5);  // the second half at half of the rate
  CHECK(rate() == doctest::Approx(0.25).epsilon(1e-6));
  CHECK(first == doctest::Approx(second).epsilon(1e-3));
  CHECK(first == doctest::Approx(kHalfNS * std::numbers::ln2).epsilon(1e-3));
}

TEST_CASE("a spindle that comes to rest cuts nothing, whatever the exponent of its speed") {
  for (const double exponent : {0.0, 0.3, 1.0, 2.0}) {
    const auto law = cut_law<FixedNumbers>({.speed_exponent = exponent}, 1000);
    CHECK(cut_drive(law, Q16(3), Q30(0)) == 0);
    std::int64_t last = 0;
    for (std::int32_t ratio = 1; ratio < 1 << 30; ratio += 1 + ratio / 64) {
      const std::int64_t drive = cut_drive(law, Q16(3), Q30::from_raw(ratio));
      CHECK(drive >= last);
      last = drive;
    }
    CHECK(newtons<FixedNumbers>(cut_drive(law, Q16(3), Q30(1.0 / 4096))) <=
          3.0 / (1 << (12 - kSpeedFootBits)) + 1e-6);
  }
}

TEST_CASE("extremes of law, force and wear stay in range") {
  for (const double exponent : {0.1, 1.0, 2.0}) {
    for (const double wear_half_n_s : {0.0, 1.0, 1e9, 1e30}) {
      const auto law = cut_law<FixedNumbers>({.reference_n = 0.01,
                                              .force_exponent = exponent,
                                              .speed_exponent = exponent,
                                              .wear_half_n_s = wear_half_n_s},
                                             8000);
      BurWear<FixedNumbers> wear;
      for (int i = 0; i < 100; ++i) {
        const auto sharp =
            cut_drive(law, Q16(32767), Q30::from_raw(std::numeric_limits<std::int32_t>::max()));
        CHECK(sharp > 0);
        CHECK(sharp < std::int64_t{1} << 31);
        CHECK(wear.left_of(sharp, law) >= 0);
        CHECK(wear.left_of(sharp, law) <= sharp);
        wear.add(sharp);
      }
      wear.sum = kMaxWear;  // for years
      wear.add(1);
      CHECK(wear.sum == kMaxWear);
      CHECK(wear.left_of(1 << 24, law) >= 0);
    }
  }
}

}  // namespace kerf::cut_law_test
