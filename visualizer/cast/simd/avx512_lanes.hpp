// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <immintrin.h>

// For the AVX-512 files: packets of 4x4 rays.

namespace kerf {
namespace {

/// All of a `Simd` but the loads from places of which the lanes know their own.
struct Avx512 {
  using F = __m512;
  using I = std::int32_t __attribute__((vector_size(64)));
  using M = __mmask16;
  static constexpr int kWide = 4, kHigh = 4;

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
  static I high_half(I a) noexcept { return (I)_mm512_srli_epi32((__m512i)a, 16); }
  static F sqrt(F a) noexcept { return _mm512_sqrt_ps(a); }
  static F min(F a, F b) noexcept { return _mm512_min_ps(a, b); }
  static F max(F a, F b) noexcept { return _mm512_max_ps(a, b); }

  static M none() noexcept { return 0; }
  static M all() noexcept { return 0xffff; }
  static M less(F a, F b) noexcept { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ); }
  static M equal(F a, F b) noexcept { return _mm512_cmp_ps_mask(a, b, _CMP_EQ_OQ); }
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

  static void gather_four(const float* p, I at, F (&out)[4]) noexcept {
    const Lanes lane(at);
    const auto load = [&](int i) { return _mm_loadu_ps(p + lane.at[i]); };
    const auto row = [&](int i) { return joined(load(i), load(i + 4), load(i + 8), load(i + 12)); };
    const F row0 = row(0), row1 = row(1), row2 = row(2), row3 = row(3);
    const F low01 = _mm512_unpacklo_ps(row0, row1);
    const F low23 = _mm512_unpacklo_ps(row2, row3);
    const F high01 = _mm512_unpackhi_ps(row0, row1);
    const F high23 = _mm512_unpackhi_ps(row2, row3);
    out[0] = _mm512_shuffle_ps(low01, low23, 0x44);
    out[1] = _mm512_shuffle_ps(low01, low23, 0xee);
    out[2] = _mm512_shuffle_ps(high01, high23, 0x44);
    out[3] = _mm512_shuffle_ps(high01, high23, 0xee);
  }

 protected:
  static F joined(__m128 a, __m128 b, __m128 c, __m128 d) noexcept {
    const __m256 low = _mm256_insertf128_ps(_mm256_castps128_ps256(a), b, 1);
    const __m256 high = _mm256_insertf128_ps(_mm256_castps128_ps256(c), d, 1);
    return _mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
  }

  struct Lanes {
    explicit Lanes(I of) noexcept { store(at, of); }
    std::int32_t at[kWide * kHigh];
  };
};

}  // namespace
}  // namespace kerf
