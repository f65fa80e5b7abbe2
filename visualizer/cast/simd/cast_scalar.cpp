// SPDX-License-Identifier: Apache-2.0

#include <cstdint>
#include <cstring>

#include "visualizer/cast/cast_kernels.hpp"

// One ray at a time, for any machine: the reference for the packets of the other sets.

namespace kerf {
namespace {

struct Simd {
  using F = float;
  using I = std::int32_t;
  using M = bool;
  static constexpr int kWide = 1, kHigh = 1;

  static F set(float a) noexcept { return a; }
  static F lane_x() noexcept { return 0.0F; }
  static F lane_y() noexcept { return 0.0F; }
  static void store(void* p, F a) noexcept { std::memcpy(p, &a, sizeof(a)); }
  static void store(void* p, I a) noexcept { std::memcpy(p, &a, sizeof(a)); }

  /// Towards zero.
  static I to_int(F a) noexcept { return static_cast<I>(a); }
  static F to_float(I a) noexcept { return static_cast<F>(a); }
  static I bits(F a) noexcept { return __builtin_bit_cast(I, a); }
  static F from_bits(I a) noexcept { return __builtin_bit_cast(F, a); }
  static I high_half(I a) noexcept { return a >> 16 & 0xffff; }
  static F sqrt(F a) noexcept { return __builtin_sqrtf(a); }
  /// If a is NaN, `min` and `max` return b.
  static F min(F a, F b) noexcept { return a < b ? a : b; }
  static F max(F a, F b) noexcept { return a > b ? a : b; }

  static M none() noexcept { return false; }
  static M all() noexcept { return true; }
  static M less(F a, F b) noexcept { return a < b; }
  static M equal(F a, F b) noexcept { return a == b; }
  static M equal(I a, I b) noexcept { return a == b; }
  static M both(M a, M b) noexcept { return a && b; }
  static M either(M a, M b) noexcept { return a || b; }
  static M but_not(M a, M b) noexcept { return a && !b; }
  static bool any(M a) noexcept { return a; }
  static int count(M a) noexcept { return a ? 1 : 0; }
  static F select(M m, F yes, F no) noexcept { return m ? yes : no; }
  static I select(M m, I yes, I no) noexcept { return m ? yes : no; }

  /// The four bytes from entry `at` on, in 1-, 2- or 4-byte entries.
  template <int kEntryBytes>
  static I gather_bytes(const void* p, I at) noexcept {
    I value;
    std::memcpy(&value, static_cast<const char*>(p) + std::ptrdiff_t{at} * kEntryBytes, 4);
    return value;
  }
  /// Loads two times four bytes, one after the other.
  template <int kEntryBytes>
  static void gather_two(const void* p, I at, I& first, I& second) noexcept {
    const char* const from = static_cast<const char*>(p) + std::ptrdiff_t{at} * kEntryBytes;
    std::memcpy(&first, from, 4);
    std::memcpy(&second, from + 4, 4);
  }
  /// Entries `at` to `at + 3`.
  static void gather_four(const float* p, I at, F (&out)[4]) noexcept {
    std::memcpy(out, p + at, sizeof(out));
  }
};

}  // namespace
}  // namespace kerf

#include "visualizer/cast/simd/packet_blend.hpp"
#include "visualizer/cast/simd/packet_iso.hpp"
#include "visualizer/cast/simd/packet_redraw.hpp"

namespace kerf {

const CastKernels kCastScalar{"scalar", cast_iso, cast_blend, cast_rays_touch,
                              cast_shading_touches};

}  // namespace kerf
