// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/cut_budget.hpp"
#include "shared/numeric/elementary.hpp"
#include "shared/numeric/numbers.hpp"

// How press and speed of a bur become removal (docs/forces.md 6.1):
//
//   drive = F_1 ((min(F_n, F_s) - F_0) / F_1)^a (omega / omega_ref)^b / (1 + W / W_half)
//
// in newtons: what Preston's law would need as force at the reference speed for the same removal.
// a = b = 1 without F_s and W_half is Preston's law, to the bit.

namespace kerf {

/// A speed below which a law with b < 1 falls in proportion to speed, over the reference speed.
/// Grains cannot take away more in a turn than they stand out: a bur of radius 0.7 mm that touches
/// over 1 mm^2 with grains 30 um high removes at most 0.03 mm^3 in a turn, so the 1 to 5 mm^3/s of
/// the fastest published cuts need 2,000 to 10,000 rpm. The lowest power of two in it: 2,344 rpm.
inline constexpr int kSpeedFootBits = 7;

/// y = r (x / r)^p for x >= 0, on fixed-point numbers that keep their fraction bits, or on doubles.
/// Constant during a run.
///
/// Fixed: by octaves of x; in each, the power of the mantissa by linear steps between 129 entries:
/// within |p (p - 1)| / 2^17 of the value, 1.5e-5 at p = 2, and one step. Rises with x; 0 stays 0.
/// Saturates at `largest`. p = 1 returns x itself. Floating: to 1e-13, without a libm.
template <class N>
class PowerLaw {
 public:
  static constexpr int kSegmentBits = 7, kOctaves = 32;

  constexpr PowerLaw() noexcept = default;  ///< p = 1

  /// `one` is r in the steps of x; floating: r. Below `foot` (0: nowhere), a power of two, y is in
  /// proportion to x. Load time.
  constexpr PowerLaw(double exponent, double one, double foot, std::int64_t largest) noexcept
      : exponent_(exponent), one_(one), foot_(foot), largest_(largest) {
    if constexpr (N::kIsFixed) {
      if (exponent == 1) return;
      for (std::size_t i = 0; i < mantissa_.size(); ++i) {
        mantissa_[i] = static_cast<std::uint32_t>(
            power(1 + double(i) / kSegments, exponent) * (1 << kMantissaBits) + 0.5);
      }
      double low = 1;
      for (Octave& octave : octave_) {
        const bool straight = low < foot;
        octave = octave_of(
            straight ? low * power(foot / one, exponent - 1) : one * power(low / one, exponent),
            straight);
        low *= 2;
      }
    }
  }

  [[nodiscard]] constexpr typename N::Sum of(typename N::Sum x) const noexcept {
    if (exponent_ == 1) return x;
    if (!(x > 0)) return 0;
    if constexpr (N::kIsFixed) {
      const auto wide = static_cast<std::uint64_t>(std::min(x, (std::int64_t{1} << kOctaves) - 1));
      const int top = static_cast<int>(std::bit_width(wide)) - 1;
      const Octave& octave = octave_[static_cast<std::size_t>(top)];
      if (octave.shift < kMantissaBits) return largest_;
      const auto fraction = static_cast<std::uint32_t>(wide << (kOctaves - 1 - top)) & 0x7fff'ffff;
      const std::uint64_t mantissa =
          octave.straight ? (std::uint64_t{1} << kMantissaBits) + (fraction >> (31 - kMantissaBits))
                          : power_of_mantissa(fraction);
      const auto product = static_cast<std::int64_t>(mantissa * octave.mantissa);
      return std::min(round_shift(product, octave.shift), largest_);
    } else {
      if (x < foot_) return x * power(foot_ / one_, exponent_ - 1);
      return one_ * power(x / one_, exponent_);
    }
  }

 private:
  static constexpr int kSegments = 1 << kSegmentBits;
  static constexpr int kMantissaBits = 28;  // 2^p for p up to 2 in 31 bits

  /// Value of the octave's lowest x: mantissa 2^-(shift - kMantissaBits), the mantissa with 31
  /// bits.
  struct Octave {
    std::uint32_t mantissa = 0;
    std::int16_t shift = 62;  ///< below kMantissaBits: more than any sum holds
    bool straight = false;    ///< below the foot
  };

  static constexpr Octave octave_of(double value, bool straight) noexcept {
    constexpr double kTop = 2147483648.0;
    constexpr int kSmallest = 62 - kMantissaBits;
    Octave octave{.straight = straight};
    int exponent = 0;
    for (; value < kTop / 2 && exponent < kSmallest; ++exponent) value *= 2;
    for (; value >= kTop - 1 && exponent > -1; --exponent) value /= 2;
    octave.mantissa = static_cast<std::uint32_t>(std::min(value, kTop - 1) + 0.5);
    octave.shift = static_cast<std::int16_t>(exponent + kMantissaBits);
    return octave;
  }

  constexpr std::uint64_t power_of_mantissa(std::uint32_t fraction) const noexcept {
    constexpr int kWithin = 31 - kSegmentBits;
    const std::size_t i = fraction >> kWithin;
    const std::int64_t rise = std::int64_t{mantissa_[i + 1]} - std::int64_t{mantissa_[i]};
    const std::int64_t within = fraction & ((1U << kWithin) - 1);
    return static_cast<std::uint64_t>(std::int64_t{mantissa_[i]} +
                                      round_shift(rise * within, kWithin));
  }

  double exponent_ = 1, one_ = 1, foot_ = 0;
  std::int64_t largest_ = 0;
  std::array<std::uint32_t, N::kIsFixed ? kSegments + 1 : 0> mantissa_{};
  std::array<Octave, N::kIsFixed ? kOctaves : 0> octave_{};
};

/// The law of a bur; constant during a run. Made by `cut_law`; as it is here, Preston's law.
template <class N>
struct CutLaw {
  typename N::Real threshold_n{};  ///< F_0, force in the scene that cuts nothing yet
  typename N::Real largest_n = typename N::Real(kAnyPressN);  ///< F_s; more force cuts no more
  PowerLaw<N> force, speed;
  /// Sum of drives, one for each tick, after which the rate has halved; 0: no wear.
  CutBudget<N> wear_half{};

  static constexpr int kAnyPressN = 32767;  ///< more than any device gives
};

/// A law as a scene has it.
struct CutLawFigures {
  double threshold_n = 0;
  double reference_n = 1;  ///< F_1: the press at which an unworn bur cuts like by Preston's law
  double force_exponent = 1, speed_exponent = 1;  ///< up to 2, the first above 0
  double largest_n = 0;                           ///< F_s; 0: there is none
  double wear_half_n_s = 0;                       ///< press times time; 0: no wear
};

inline constexpr std::int64_t kMaxWear = std::int64_t{1} << 61;

/// Load time.
template <class N>
[[nodiscard]] constexpr CutLaw<N> cut_law(const CutLawFigures& figures, double rate_hz) noexcept {
  constexpr double kForceOne = N::kIsFixed ? double(1 << kBudgetBits) : 1;
  constexpr double kSpeedOne = N::kIsFixed ? double(1 << 30) : 1;
  constexpr std::int64_t kMaxForce = (std::int64_t{1} << 31) - 1;  // 128 N
  constexpr std::int64_t kMaxSpeed = (std::int64_t{1} << 32) - 1;  // 4 times the reference speed
  CutLaw<N> law;
  law.threshold_n = typename N::Real(figures.threshold_n);
  if (figures.largest_n > 0) law.largest_n = typename N::Real(figures.largest_n);
  law.force = PowerLaw<N>(figures.force_exponent, figures.reference_n * kForceOne, 0, kMaxForce);
  const double foot = figures.speed_exponent < 1 ? kSpeedOne / (1 << kSpeedFootBits) : 0;
  law.speed = PowerLaw<N>(figures.speed_exponent, kSpeedOne, foot, kMaxSpeed);
  const double half = figures.wear_half_n_s * rate_hz * kForceOne;
  law.wear_half = static_cast<CutBudget<N>>(std::min(half, double(kMaxWear)));
  return law;
}

/// The drive of the cut of an unworn bur, newtons; 0 up to the threshold and without rotation.
/// Fixed: 24 fraction bits, at most 128 N.
template <class N>
[[nodiscard]] constexpr typename N::Sum cut_drive(const CutLaw<N>& law,
                                                  typename N::Real normal_force_n,
                                                  typename N::Unit spindle_ratio) noexcept {
  using Sum = typename N::Sum;
  const auto press_n = std::min(normal_force_n, law.largest_n);
  if (!(press_n > law.threshold_n) || !(spindle_ratio > typename N::Unit{})) return Sum{};
  if constexpr (N::kIsFixed) {
    constexpr std::int64_t kMaxAbove = std::int64_t{64} << 16;
    const std::int64_t above =
        std::min(std::int64_t{press_n.raw()} - law.threshold_n.raw(), kMaxAbove);
    const std::int64_t force = law.force.of(above << (kBudgetBits - 16));
    const std::int64_t drive = round_shift(force * law.speed.of(spindle_ratio.raw()), 30);
    return std::min(drive, (std::int64_t{1} << 31) - 1);
  } else {
    return law.force.of(Sum(press_n - law.threshold_n)) * law.speed.of(Sum(spindle_ratio));
  }
}

/// Wear of one bur: the sum of the unworn drives at which it has cut, tick by tick. The same at
/// every rate, and independent of how sharp it was meanwhile.
template <class N>
struct BurWear {
  CutBudget<N> sum{};

  /// 1 / (1 + W / W_half), as a `fraction_of`.
  [[nodiscard]] constexpr CutBudget<N> sharpness(const CutLaw<N>& law) const noexcept {
    const auto half = static_cast<CutWeight<N>>(law.wear_half);
    if (!(half > 0)) return static_cast<CutBudget<N>>(fraction_of<N>(1, 1));
    return static_cast<CutBudget<N>>(fraction_of<N>(half, half + static_cast<CutWeight<N>>(sum)));
  }
  /// What is left of a drive. Fixed: rounded down, but for an unworn bur.
  [[nodiscard]] constexpr typename N::Sum left_of(typename N::Sum drive,
                                                  const CutLaw<N>& law) const noexcept {
    return law.wear_half > 0 ? portion<N>(drive, sharpness(law)) : drive;
  }
  constexpr void add(typename N::Sum drive) noexcept {
    if constexpr (N::kIsFixed) {
      sum = std::min(sum + drive, kMaxWear);
    } else {
      sum += drive;
    }
  }
};

}  // namespace kerf
