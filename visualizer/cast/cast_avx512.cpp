// SPDX-License-Identifier: Apache-2.0
// AVX-512: packets of 4x4 rays.
#include <cstddef>
#include <cstdint>

#include <immintrin.h>

#include "visualizer/cast/cast_job.hpp"

namespace kerf {
namespace {

struct Simd {
  using F = __m512;
  using I = std::int32_t __attribute__((vector_size(64)));
  using M = __mmask16;
  static constexpr int kWide = 4, kHigh = 4;
  static constexpr int kAhead = 3;  ///< samples of a ray at once: more would not stay in registers

  static F set(float a) noexcept { return _mm512_set1_ps(a); }
  static F lane_x() noexcept {
    return _mm512_setr_ps(0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3);
  }
  static F lane_y() noexcept {
    return _mm512_setr_ps(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
  }
  static void store(void* p, F a) noexcept { _mm512_storeu_ps(p, a); }
  static void store(void* p, I a) noexcept { _mm512_storeu_si512(p, (__m512i)a); }

  static I to_int(F a) noexcept { return (I)_mm512_cvttps_epi32(a); }
  static F to_float(I a) noexcept { return _mm512_cvtepi32_ps((__m512i)a); }
  static I bits(F a) noexcept { return (I)_mm512_castps_si512(a); }
  static F from_bits(I a) noexcept { return _mm512_castsi512_ps((__m512i)a); }
  static F sqrt(F a) noexcept { return _mm512_sqrt_ps(a); }
  static F min(F a, F b) noexcept { return _mm512_min_ps(a, b); }
  static F max(F a, F b) noexcept { return _mm512_max_ps(a, b); }

  static M none() noexcept { return 0; }
  static M all() noexcept { return 0xffff; }
  static M less(F a, F b) noexcept { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ); }
  static M equal(I a, I b) noexcept { return _mm512_cmpeq_epi32_mask((__m512i)a, (__m512i)b); }
  static M both(M a, M b) noexcept { return _kand_mask16(a, b); }
  static M either(M a, M b) noexcept { return _kor_mask16(a, b); }
  static M but_not(M a, M b) noexcept { return _kandn_mask16(b, a); }
  static bool any(M a) noexcept { return a != 0; }
  static int count(M a) noexcept { return __builtin_popcount(a); }
  static F select(M m, F yes, F no) noexcept { return _mm512_mask_blend_ps(m, no, yes); }
  static I select(M m, I yes, I no) noexcept {
    return (I)_mm512_mask_blend_epi32(m, (__m512i)no, (__m512i)yes);
  }

  static F gather(const float* p, I at) noexcept {
    return _mm512_i32gather_ps((__m512i)at, p, sizeof(float));
  }
  template <int kEntryBytes>
  static I gather_bytes(const void* p, I at) noexcept {
    return (I)_mm512_i32gather_epi32((__m512i)at, p, kEntryBytes);
  }
  static void gather_two(const std::uint32_t* p, I at, I& first, I& second) noexcept {
    const __m512i low = _mm512_i32gather_epi64(_mm512_castsi512_si256((__m512i)at), p, 4);
    const __m512i high = _mm512_i32gather_epi64(_mm512_extracti64x4_epi64((__m512i)at, 1), p, 4);
    const __m512i even =
        _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
    const __m512i odd = _mm512_add_epi32(even, _mm512_set1_epi32(1));
    first = (I)_mm512_permutex2var_epi32(low, even, high);
    second = (I)_mm512_permutex2var_epi32(low, odd, high);
  }
};

}  // namespace
}  // namespace kerf

#include "visualizer/cast/packet_blend.hpp"
#include "visualizer/cast/packet_iso.hpp"

namespace kerf {

const CastKernels kCastAvx512{"avx512", cast_iso, cast_blend};

}  // namespace kerf
