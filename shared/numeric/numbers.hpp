// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <compare>
#include <concepts>
#include <cstdint>
#include <limits>

// The numbers of the servo: saturating fixed point, and the two bundles of number types.

namespace kerf {

/// Narrows to 32 bits; a value outside the range becomes the nearest end of the range.
[[nodiscard]] constexpr std::int32_t saturate_i32(std::int64_t wide) noexcept {
  constexpr std::int64_t kMin = std::numeric_limits<std::int32_t>::min();
  constexpr std::int64_t kMax = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(wide < kMin ? kMin : wide > kMax ? kMax : wide);
}

/// Sum of two numbers; if it would leave the range, the nearest end of the range.
[[nodiscard]] constexpr std::int64_t saturating_add(std::int64_t a, std::int64_t b) noexcept {
  constexpr std::int64_t kMin = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
  if (b > 0 && a > kMax - b) return kMax;
  if (b < 0 && a < kMin - b) return kMin;
  return a + b;
}

/// Drops `bits` low bits, rounding half up. `bits` in 0..62; |wide| < 2^62.
[[nodiscard]] constexpr std::int64_t round_shift(std::int64_t wide, int bits) noexcept {
  return bits == 0 ? wide : (wide + (std::int64_t{1} << (bits - 1))) >> bits;
}

/// Largest integer whose square is at most `value`; one step for every two bits of it, 32 at most.
[[nodiscard]] constexpr std::uint32_t integer_sqrt(std::uint64_t value) noexcept {
  std::uint64_t root = 0;
  const int top = (63 - std::countl_zero(value | 1)) & ~1;
  for (std::uint64_t bit = std::uint64_t{1} << top; bit != 0; bit >>= 2) {
    // All ones if the bit fits; a branch here would be mispredicted half of the time.
    const std::uint64_t fits = value >= root + bit ? ~std::uint64_t{0} : 0;
    value -= (root + bit) & fits;
    root = (root >> 1) + (bit & fits);
  }
  return static_cast<std::uint32_t>(root);
}

/// A 32-bit number with `F` fraction bits: range +-2^(31-F), step 2^-F.
///
/// Saturates at both ends, because a force that wraps points the wrong way. Products, quotients and
/// conversions round half up. Nothing converts silently. NaN becomes 0; x / 0 saturates by the sign
/// of x. Any thread; never allocates, never throws.
template <int F>
class Fixed {
  static_assert(F >= 0 && F <= 31);

 public:
  static constexpr int kFractionBits = F;

  constexpr Fixed() noexcept = default;
  explicit constexpr Fixed(int whole) noexcept
      : raw_(saturate_i32(static_cast<std::int64_t>(whole) * (std::int64_t{1} << F))) {}
  /// `std::int32_t` in newlib, the C library of processors without an operating system.
  template <std::same_as<long> Long>
  requires(sizeof(Long) == sizeof(int)) explicit constexpr Fixed(Long whole) noexcept
      : Fixed(static_cast<int>(whole)) {}
  explicit constexpr Fixed(double value) noexcept : raw_(raw_from(value)) {}
  template <int G>
  explicit constexpr Fixed(Fixed<G> other) noexcept : raw_(raw_from(other)) {}

  [[nodiscard]] static constexpr Fixed from_raw(std::int32_t raw) noexcept {
    Fixed f;
    f.raw_ = raw;
    return f;
  }
  /// From `wide * 2^-bits`, rounded and saturated. `bits` >= F.
  [[nodiscard]] static constexpr Fixed from_wide(std::int64_t wide, int bits) noexcept {
    return from_raw(saturate_i32(round_shift(wide, bits - F)));
  }

  [[nodiscard]] constexpr std::int32_t raw() const noexcept { return raw_; }
  explicit constexpr operator double() const noexcept {
    return static_cast<double>(raw_) / static_cast<double>(std::int64_t{1} << F);
  }
  explicit constexpr operator float() const noexcept {
    return static_cast<float>(static_cast<double>(*this));
  }

  friend constexpr Fixed operator+(Fixed a, Fixed b) noexcept {
    return from_raw(saturate_i32(std::int64_t{a.raw_} + b.raw_));
  }
  friend constexpr Fixed operator-(Fixed a, Fixed b) noexcept {
    return from_raw(saturate_i32(std::int64_t{a.raw_} - b.raw_));
  }
  friend constexpr Fixed operator-(Fixed a) noexcept {
    return from_raw(saturate_i32(-std::int64_t{a.raw_}));
  }
  friend constexpr Fixed operator*(Fixed a, Fixed b) noexcept {
    return from_wide(std::int64_t{a.raw_} * b.raw_, 2 * F);
  }
  friend constexpr Fixed operator/(Fixed a, Fixed b) noexcept {
    if (b.raw_ == 0) return from_raw(a.raw_ < 0 ? kMin : a.raw_ > 0 ? kMax : 0);
    // floor((2 n + d) / (2 d)) rounds half up for either sign.
    const std::int64_t sign = b.raw_ < 0 ? -1 : 1;
    const std::int64_t n = sign * a.raw_ * (std::int64_t{1} << F);
    const std::int64_t d = sign * std::int64_t{b.raw_};
    std::int64_t quotient = n / d;
    std::int64_t rest = n % d;
    if (rest < 0) {
      rest += d;
      --quotient;
    }
    if (2 * rest >= d) ++quotient;
    return from_raw(saturate_i32(quotient));
  }
  constexpr Fixed& operator+=(Fixed b) noexcept { return *this = *this + b; }
  constexpr Fixed& operator-=(Fixed b) noexcept { return *this = *this - b; }
  friend constexpr auto operator<=>(Fixed, Fixed) noexcept = default;

 private:
  static constexpr std::int32_t kMin = std::numeric_limits<std::int32_t>::min();
  static constexpr std::int32_t kMax = std::numeric_limits<std::int32_t>::max();

  static constexpr std::int32_t raw_from(double value) noexcept {
    const double scaled = value * static_cast<double>(std::int64_t{1} << F) + 0.5;
    if (scaled != scaled) return 0;
    if (scaled <= static_cast<double>(kMin)) return kMin;
    if (scaled >= static_cast<double>(kMax)) return kMax;
    const auto toward_zero = static_cast<std::int64_t>(scaled);
    return static_cast<std::int32_t>(static_cast<double>(toward_zero) > scaled ? toward_zero - 1
                                                                               : toward_zero);
  }
  template <int G>
  static constexpr std::int32_t raw_from(Fixed<G> other) noexcept {
    if constexpr (G >= F) {
      return saturate_i32(round_shift(other.raw(), G - F));
    } else {
      return saturate_i32(std::int64_t{other.raw()} * (std::int64_t{1} << (F - G)));
    }
  }

  std::int32_t raw_ = 0;
};

using Q16 = Fixed<16>;  ///< mm, N, mm/s, voxels: range +-32768, step 1.5e-5
using Q30 = Fixed<30>;  ///< sines, rotation entries: range +-2, step 9.3e-10

/// Product of two formats, rounded once into the wanted one.
template <class To, int A, int B>
[[nodiscard]] constexpr To multiply(Fixed<A> a, Fixed<B> b) noexcept {
  static_assert(A + B >= To::kFractionBits);
  return To::from_wide(std::int64_t{a.raw()} * b.raw(), A + B);
}
template <std::floating_point To>
[[nodiscard]] constexpr To multiply(To a, To b) noexcept {
  return a * b;
}

/// Square root; a negative argument gives 0.
template <int F>
[[nodiscard]] constexpr Fixed<F> square_root(Fixed<F> x) noexcept {
  if (x.raw() <= 0) return {};
  const auto wide = static_cast<std::uint64_t>(x.raw()) << F;
  return Fixed<F>::from_raw(static_cast<std::int32_t>(integer_sqrt(wide)));
}
template <std::floating_point S>
[[nodiscard]] inline S square_root(S x) noexcept {
  return x > S(0) ? static_cast<S>(__builtin_sqrt(static_cast<double>(x))) : S(0);
}

/// False only for a floating-point NaN or infinity.
template <int F>
[[nodiscard]] constexpr bool is_finite(Fixed<F>) noexcept {
  return true;
}
template <std::floating_point S>
[[nodiscard]] constexpr bool is_finite(S x) noexcept {
  return x - x == S(0);
}

/// The number types that a kernel computes with. One template serves both bundles:
/// `FixedNumbers` is the default in the loop, `DoubleNumbers` the reference in tests.
///
///   Real      mm, N, voxels             Unit      sines, rotation entries, |x| <= 1
///   Angle     radians, |x| < 8          Ratio     voxels per mm, |x| < 128
///   Step      voxels per tool pitch     Gradient  stored density gradient, density steps per voxel
///   Weight    trilinear weight, 0..kWeightOne    Sample  interpolated value, 8 kept bits in fixed
///   Sum       exact sums, never saturate: wide enough, order does not matter in fixed
///   Energy    N mm (= mJ) with 32 fraction bits in fixed
struct FixedNumbers {
  static constexpr const char* kName = "fixed";
  static constexpr bool kIsFixed = true;
  using Real = Q16;
  using Unit = Q30;
  using Angle = Fixed<28>;
  using Ratio = Fixed<24>;
  using Step = std::int32_t;      // Q11.20
  using Gradient = std::int16_t;  // L1 norm of each kernel <= 0.5, so it cannot overflow
  using Weight = std::int32_t;    // Q0.15, stored as u16 where memory counts
  using Sample = std::int32_t;    // 8 kept bits
  using Sum = std::int64_t;
  using Energy = std::int64_t;
  static constexpr Weight kWeightOne = 1 << 15;
  static constexpr Step kStepOne = 1 << 20;
  static constexpr Sample kSampleOne = 1 << 8;
};

struct DoubleNumbers {
  static constexpr const char* kName = "double";
  static constexpr bool kIsFixed = false;
  using Real = double;
  using Unit = double;
  using Angle = double;
  using Ratio = double;
  using Step = double;
  using Gradient = double;
  using Weight = double;
  using Sample = double;
  using Sum = double;
  using Energy = double;
  static constexpr Weight kWeightOne = 1;
  static constexpr Step kStepOne = 1;
  static constexpr Sample kSampleOne = 1;
};

}  // namespace kerf
