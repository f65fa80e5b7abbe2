// SPDX-License-Identifier: Apache-2.0
// AVX-512 with VNNI: 32 densities at a time.
#include <cstddef>
#include <cstdint>

#include <immintrin.h>

#include "controller/kernel/sets/set_common.hpp"

namespace kerf {
namespace {

struct Simd {
  using V = __m512i;
  static constexpr int kLanes = 32;

  static V load(const void* p) noexcept { return _mm512_loadu_si512(p); }
  static void store(void* p, V a) noexcept { _mm512_storeu_si512(p, a); }
  static V zero() noexcept { return _mm512_setzero_si512(); }
  static V set16(int a) noexcept { return _mm512_set1_epi16(static_cast<short>(a)); }
  static V set32(int a) noexcept { return _mm512_set1_epi32(a); }
  static V pair16(int a, int b) noexcept { return set32((a & 0xffff) | b * 65536); }

  /// sum += a0 b0 + a1 b1 in each 32 bits. As inline assembly, because with the intrinsic g++ 12
  /// copies each sum.
  static void multiply_add(V& sum, V a, V b) noexcept {
    __asm__("vpdpwssd %2, %1, %0" : "+v"(sum) : "v"(a), "v"(b));
  }
  static V multiply_even(V a, V b) noexcept { return _mm512_mul_epi32(a, b); }
  static V multiply_even_unsigned(V a, V b) noexcept { return _mm512_mul_epu32(a, b); }
  static V odd32(V a) noexcept { return _mm512_srli_epi64(a, 32); }
  static V multiply32(V a, V b) noexcept { return _mm512_mullo_epi32(a, b); }
  static V multiply_high(V a, V b) noexcept { return _mm512_mulhi_epu16(a, b); }
  static V multiply_low(V a, V b) noexcept { return _mm512_mullo_epi16(a, b); }

  static V add16(V a, V b) noexcept { return _mm512_add_epi16(a, b); }
  static V sub16(V a, V b) noexcept { return _mm512_sub_epi16(a, b); }
  static V add32(V a, V b) noexcept { return _mm512_add_epi32(a, b); }
  static V sub32(V a, V b) noexcept { return _mm512_sub_epi32(a, b); }
  static V add64(V a, V b) noexcept { return _mm512_add_epi64(a, b); }
  static V sub64(V a, V b) noexcept { return _mm512_sub_epi64(a, b); }
  /// Of entries below 2^63.
  static V min64(V a, V b) noexcept { return _mm512_min_epu64(a, b); }
  static V srl64(V a, V n) noexcept { return _mm512_srlv_epi64(a, n); }
  static bool negative64(V a) noexcept { return _mm512_movepi64_mask(a) != 0; }
  static V times512(V a) noexcept { return _mm512_slli_epi64(a, 9); }
  static V shift_left16(V a, int n) noexcept { return _mm512_sll_epi16(a, _mm_cvtsi32_si128(n)); }
  static V shift_right16(V a, int n) noexcept { return _mm512_srl_epi16(a, _mm_cvtsi32_si128(n)); }
  /// Divides 32-bit entries by 2^16, rounding towards minus infinity.
  static V upper16_of_32(V a) noexcept { return _mm512_srai_epi32(a, 16); }
  template <int kBits>
  static V sra32(V a) noexcept {
    return _mm512_srai_epi32(a, kBits);
  }
  template <int kBits>
  static V srl32(V a) noexcept {
    return _mm512_srli_epi32(a, kBits);
  }
  template <int kBits>
  static V sll32(V a) noexcept {
    return _mm512_slli_epi32(a, kBits);
  }
  static V srl32(V a, int n) noexcept { return _mm512_srl_epi32(a, _mm_cvtsi32_si128(n)); }
  static V min32(V a, V b) noexcept { return _mm512_min_epi32(a, b); }
  static V max32(V a, V b) noexcept { return _mm512_max_epi32(a, b); }
  template <int kBits>
  static V srl16(V a) noexcept {
    return _mm512_srli_epi16(a, kBits);
  }
  /// a0 b0 + a1 b1 in each 32 bits, signed halves.
  static V multiply_pairs(V a, V b) noexcept { return _mm512_madd_epi16(a, b); }
  /// Low halves of 64 bits become the high ones.
  static V even32(V a) noexcept { return _mm512_slli_epi64(a, 32); }
  static V low32(V a) noexcept { return _mm512_maskz_mov_epi32(0x5555, a); }
  static bool any(V a) noexcept { return _mm512_test_epi32_mask(a, a) != 0; }
  /// (a b + 2^14) / 2^15 in each 16 bits.
  static V multiply_round(V a, V b) noexcept { return _mm512_mulhrs_epi16(a, b); }

  /// The densities index and index + 1 of each of 16 indices.
  static V load_pairs(const std::uint16_t* density, const std::uint32_t* index) noexcept {
    const __m256i low = _mm256_setr_m128i(load_four_pairs(density, index),
                                          load_four_pairs(density, index + 4)),
                  high = _mm256_setr_m128i(load_four_pairs(density, index + 8),
                                           load_four_pairs(density, index + 12));
    return _mm512_inserti64x4(_mm512_castsi256_si512(low), high, 1);
  }

  static V gather32(const std::uint32_t* table, V index) noexcept {
    return _mm512_i32gather_epi32(index, table, 4);
  }
  /// 0, 1, 2 .. in 32 bits each.
  static V count32() noexcept {
    return _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  }
  /// 16-bit entries as 32 bits each, without sign, and back.
  static V widen16(const void* p) noexcept {
    return _mm512_cvtepu16_epi32(_mm256_loadu_si256(static_cast<const __m256i*>(p)));
  }
  static V widen8(const std::uint8_t* p) noexcept {
    return _mm512_cvtepu8_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)));
  }
  static void narrow16(std::uint16_t* p, V a) noexcept {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), _mm512_cvtepi32_epi16(a));
  }

  static V bit_and(V a, V b) noexcept { return _mm512_and_si512(a, b); }
  static V bit_or(V a, V b) noexcept { return _mm512_or_si512(a, b); }
  static V bit_xor(V a, V b) noexcept { return _mm512_xor_si512(a, b); }
  static V unpack_low(V a, V b) noexcept { return _mm512_unpacklo_epi16(a, b); }
  static V unpack_high(V a, V b) noexcept { return _mm512_unpackhi_epi16(a, b); }

  static V add_where(V sum, std::uint32_t bits, V w) noexcept {
    return _mm512_mask_add_epi16(sum, bits, sum, w);
  }
  static V zero_where_equal(V kept, V a, V b) noexcept {
    return _mm512_maskz_mov_epi16(_mm512_cmpneq_epi16_mask(a, b), kept);
  }
  static std::uint32_t not_zero32(V a) noexcept { return _mm512_test_epi32_mask(a, a); }
  static std::uint32_t not_zero16(V a) noexcept { return _mm512_test_epi16_mask(a, a); }
  /// `high` plus the carry out of `part` + something = `sum`.
  static V add_carry(V high, V sum, V part) noexcept {
    return _mm512_mask_add_epi16(high, _mm512_cmplt_epu16_mask(sum, part), high, set16(1));
  }
  /// Sums of entries i and i + 8 as 64 bits.
  static V widened(V a) noexcept {
    return add64(_mm512_cvtepi32_epi64(_mm512_castsi512_si256(a)),
                 _mm512_cvtepi32_epi64(_mm512_extracti64x4_epi64(a, 1)));
  }
  static std::int64_t sum64(V a) noexcept { return _mm512_reduce_add_epi64(a); }

  /// density[begin + i] = rho_i - loss_i where bit i of `lost` is set; touches no other memory.
  static void write_loss(std::uint16_t* density, std::ptrdiff_t begin, std::ptrdiff_t /*count*/,
                         V rho, V loss, std::uint32_t lost) noexcept {
    _mm512_mask_storeu_epi16(density + begin, lost, sub16(rho, loss));
  }

  /// out[i][e] = in[e][i].
  static void transpose4(const std::uint32_t (&in)[4][16], std::uint32_t (*out)[4]) noexcept {
    const V a = load(in[0]), b = load(in[1]), c = load(in[2]), d = load(in[3]);
    const V ab_low = _mm512_unpacklo_epi32(a, b), ab_high = _mm512_unpackhi_epi32(a, b);
    const V cd_low = _mm512_unpacklo_epi32(c, d), cd_high = _mm512_unpackhi_epi32(c, d);
    const V row[4] = {_mm512_unpacklo_epi64(ab_low, cd_low), _mm512_unpackhi_epi64(ab_low, cd_low),
                      _mm512_unpacklo_epi64(ab_high, cd_high),
                      _mm512_unpackhi_epi64(ab_high, cd_high)};
    // row[k] holds entries k, k + 4, k + 8, k + 12.
    for (int k = 0; k < 4; ++k) {
      store4(out[k], _mm512_castsi512_si128(row[k]));
      store4(out[k + 4], _mm512_extracti32x4_epi32(row[k], 1));
      store4(out[k + 8], _mm512_extracti32x4_epi32(row[k], 2));
      store4(out[k + 12], _mm512_extracti32x4_epi32(row[k], 3));
    }
  }
  static void store4(void* p, __m128i a) noexcept { _mm_storeu_si128(static_cast<__m128i*>(p), a); }
  static __m128i load4(const void* p) noexcept {
    return _mm_loadu_si128(static_cast<const __m128i*>(p));
  }

  /// Adds one cell's gradients times their weights: each edge of two voxels in its own quarter as
  /// x, y, z, 0. Reads four bytes beyond each second voxel.
  static void add_cell(V& sum, const std::int16_t* g, std::ptrdiff_t row, std::ptrdiff_t plane,
                       const std::uint32_t (&weight)[4]) noexcept {
    V cell = _mm512_castsi128_si512(load4(g));
    cell = _mm512_inserti32x4(cell, load4(g + row), 1);
    cell = _mm512_inserti32x4(cell, load4(g + plane), 2);
    cell = _mm512_inserti32x4(cell, load4(g + plane + row), 3);
    const V by_axis =
        _mm512_broadcast_i32x4(_mm_setr_epi8(0, 1, 6, 7, 2, 3, 8, 9, 4, 5, 10, 11, -1, -1, -1, -1));
    const V edge = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
    multiply_add(sum, _mm512_shuffle_epi8(cell, by_axis),
                 _mm512_permutexvar_epi32(edge, _mm512_castsi128_si512(load4(weight))));
  }
};

}  // namespace
}  // namespace kerf

#include "controller/kernel/sets/correlate_vector.hpp"
#include "controller/kernel/sets/cover_vector.hpp"
#include "controller/kernel/sets/gather_vector.hpp"
#include "controller/kernel/sets/point_vector.hpp"
#include "controller/kernel/sets/set_table.hpp"

namespace kerf {

const KernelSet kAvx512Set = the_set<kAvx512Shape>();

}  // namespace kerf
