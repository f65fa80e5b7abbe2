// SPDX-License-Identifier: Apache-2.0
// For the files that define `Simd` only: two packets of rays as one.
#pragma once

#include <cstdint>

namespace kerf {
namespace {

/// A `Simd` whose lanes are those of `Half` twice, one packet above the other. Each operation is
/// two that do not wait for one another: while a load, division or root of one packet is under way,
/// the other computes. Only where all of it is inlined: else the pairs travel through memory.
template <class Half>
struct Twice {
  struct F {
    typename Half::F low, high;
    friend F operator+(F a, F b) noexcept { return {a.low + b.low, a.high + b.high}; }
    friend F operator-(F a, F b) noexcept { return {a.low - b.low, a.high - b.high}; }
    friend F operator*(F a, F b) noexcept { return {a.low * b.low, a.high * b.high}; }
    friend F operator/(F a, F b) noexcept { return {a.low / b.low, a.high / b.high}; }
    friend F operator-(F a) noexcept { return {-a.low, -a.high}; }
  };
  struct I {
    typename Half::I low, high;
    friend I operator+(I a, I b) noexcept { return {a.low + b.low, a.high + b.high}; }
    friend I operator|(I a, I b) noexcept { return {a.low | b.low, a.high | b.high}; }
    friend I operator+(I a, int b) noexcept { return {a.low + b, a.high + b}; }
    friend I operator-(I a, int b) noexcept { return {a.low - b, a.high - b}; }
    friend I operator*(I a, int b) noexcept { return {a.low * b, a.high * b}; }
    friend I operator&(I a, int b) noexcept { return {a.low & b, a.high & b}; }
    friend I operator|(I a, int b) noexcept { return {a.low | b, a.high | b}; }
    friend I operator<<(I a, int b) noexcept { return {a.low << b, a.high << b}; }
    friend I operator>>(I a, int b) noexcept { return {a.low >> b, a.high >> b}; }
  };
  struct M {
    typename Half::M low, high;
  };
  static constexpr int kWide = Half::kWide, kHigh = 2 * Half::kHigh;
  static constexpr int kLanes = Half::kWide * Half::kHigh;  ///< of a half
  static constexpr int kAhead = Half::kAhead;

  static F set(float a) noexcept { return {Half::set(a), Half::set(a)}; }
  static F lane_x() noexcept { return {Half::lane_x(), Half::lane_x()}; }
  static F lane_y() noexcept {
    return {Half::lane_y(), Half::lane_y() + Half::set(static_cast<float>(Half::kHigh))};
  }
  template <class Lanes>
  static void store(void* p, Lanes a) noexcept {
    Half::store(p, a.low);
    Half::store(static_cast<std::int32_t*>(p) + kLanes, a.high);
  }

  static I to_int(F a) noexcept { return {Half::to_int(a.low), Half::to_int(a.high)}; }
  static F to_float(I a) noexcept { return {Half::to_float(a.low), Half::to_float(a.high)}; }
  static I bits(F a) noexcept { return {Half::bits(a.low), Half::bits(a.high)}; }
  static F from_bits(I a) noexcept { return {Half::from_bits(a.low), Half::from_bits(a.high)}; }
  static I high_half(I a) noexcept { return {Half::high_half(a.low), Half::high_half(a.high)}; }
  static F sqrt(F a) noexcept { return {Half::sqrt(a.low), Half::sqrt(a.high)}; }
  static F min(F a, F b) noexcept { return {Half::min(a.low, b.low), Half::min(a.high, b.high)}; }
  static F max(F a, F b) noexcept { return {Half::max(a.low, b.low), Half::max(a.high, b.high)}; }

  static M none() noexcept { return {Half::none(), Half::none()}; }
  static M all() noexcept { return {Half::all(), Half::all()}; }
  static M less(F a, F b) noexcept {
    return {Half::less(a.low, b.low), Half::less(a.high, b.high)};
  }
  template <class Lanes>
  static M equal(Lanes a, Lanes b) noexcept {
    return {Half::equal(a.low, b.low), Half::equal(a.high, b.high)};
  }
  static M both(M a, M b) noexcept {
    return {Half::both(a.low, b.low), Half::both(a.high, b.high)};
  }
  static M either(M a, M b) noexcept {
    return {Half::either(a.low, b.low), Half::either(a.high, b.high)};
  }
  static M but_not(M a, M b) noexcept {
    return {Half::but_not(a.low, b.low), Half::but_not(a.high, b.high)};
  }
  static bool any(M a) noexcept { return Half::any(Half::either(a.low, a.high)); }
  static int count(M a) noexcept { return Half::count(a.low) + Half::count(a.high); }
  template <class Lanes>
  static Lanes select(M m, Lanes yes, Lanes no) noexcept {
    return {Half::select(m.low, yes.low, no.low), Half::select(m.high, yes.high, no.high)};
  }

  template <int kEntryBytes>
  static I gather_bytes(const void* p, I at) noexcept {
    return {Half::template gather_bytes<kEntryBytes>(p, at.low),
            Half::template gather_bytes<kEntryBytes>(p, at.high)};
  }
  template <int kEntryBytes>
  static void gather_two(const void* p, I at, I& first, I& second) noexcept {
    Half::template gather_two<kEntryBytes>(p, at.low, first.low, second.low);
    Half::template gather_two<kEntryBytes>(p, at.high, first.high, second.high);
  }
  static void gather_four(const float* p, I at, F (&out)[4]) noexcept {
    typename Half::F low[4], high[4];
    Half::gather_four(p, at.low, low);
    Half::gather_four(p, at.high, high);
    for (int i = 0; i < 4; ++i) out[i] = {low[i], high[i]};
  }
};

}  // namespace
}  // namespace kerf
