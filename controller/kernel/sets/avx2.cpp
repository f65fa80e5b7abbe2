// SPDX-License-Identifier: Apache-2.0
// AVX2: 16 densities at a time.
#include <cstddef>
#include <cstdint>

#include <immintrin.h>

#include "controller/kernel/sets/set_common.hpp"

namespace kerf {
namespace {

struct Simd {
  using V = __m256i;
  static constexpr int kLanes = 16;

  static V load(const void* p) noexcept {
    return _mm256_loadu_si256(static_cast<const __m256i*>(p));
  }
  static void store(void* p, V a) noexcept { _mm256_storeu_si256(static_cast<__m256i*>(p), a); }
  static V zero() noexcept { return _mm256_setzero_si256(); }
  static V set16(int a) noexcept { return _mm256_set1_epi16(static_cast<short>(a)); }
  static V set32(int a) noexcept { return _mm256_set1_epi32(a); }
  static V pair16(int a, int b) noexcept { return set32((a & 0xffff) | b * 65536); }

  /// sum += a0 b0 + a1 b1 in each 32 bits. As inline assembly, because with intrinsics g++ 12
  /// spills a sum, and the store and reload then limit the loop.
  static void multiply_add(V& sum, V a, V b) noexcept {
    V product;
    __asm__("vpmaddwd %3, %2, %1\n\tvpaddd %1, %0, %0"
            : "+x"(sum), "=&x"(product)
            : "x"(a), "x"(b));
  }
  static V multiply_even(V a, V b) noexcept { return _mm256_mul_epi32(a, b); }
  static V multiply_even_unsigned(V a, V b) noexcept { return _mm256_mul_epu32(a, b); }
  static V odd32(V a) noexcept { return _mm256_srli_epi64(a, 32); }
  static V multiply32(V a, V b) noexcept { return _mm256_mullo_epi32(a, b); }
  static V multiply_high(V a, V b) noexcept { return _mm256_mulhi_epu16(a, b); }
  static V multiply_low(V a, V b) noexcept { return _mm256_mullo_epi16(a, b); }

  static V add16(V a, V b) noexcept { return _mm256_add_epi16(a, b); }
  static V sub16(V a, V b) noexcept { return _mm256_sub_epi16(a, b); }
  static V add32(V a, V b) noexcept { return _mm256_add_epi32(a, b); }
  static V sub32(V a, V b) noexcept { return _mm256_sub_epi32(a, b); }
  static V add64(V a, V b) noexcept { return _mm256_add_epi64(a, b); }
  static V sub64(V a, V b) noexcept { return _mm256_sub_epi64(a, b); }
  /// Of entries below 2^63.
  static V min64(V a, V b) noexcept { return _mm256_blendv_epi8(a, b, _mm256_cmpgt_epi64(a, b)); }
  static V srl64(V a, V n) noexcept { return _mm256_srlv_epi64(a, n); }
  static bool negative64(V a) noexcept { return _mm256_movemask_pd(_mm256_castsi256_pd(a)) != 0; }
  static V times512(V a) noexcept { return _mm256_slli_epi64(a, 9); }
  static V shift_left16(V a, int n) noexcept { return _mm256_sll_epi16(a, _mm_cvtsi32_si128(n)); }
  static V shift_right16(V a, int n) noexcept { return _mm256_srl_epi16(a, _mm_cvtsi32_si128(n)); }
  /// Divides 32-bit entries by 2^16, rounding towards minus infinity.
  static V upper16_of_32(V a) noexcept { return _mm256_srai_epi32(a, 16); }
  template <int kBits>
  static V sra32(V a) noexcept {
    return _mm256_srai_epi32(a, kBits);
  }
  template <int kBits>
  static V srl32(V a) noexcept {
    return _mm256_srli_epi32(a, kBits);
  }
  template <int kBits>
  static V sll32(V a) noexcept {
    return _mm256_slli_epi32(a, kBits);
  }
  static V srl32(V a, int n) noexcept { return _mm256_srl_epi32(a, _mm_cvtsi32_si128(n)); }
  static V min32(V a, V b) noexcept { return _mm256_min_epi32(a, b); }
  static V max32(V a, V b) noexcept { return _mm256_max_epi32(a, b); }
  template <int kBits>
  static V srl16(V a) noexcept {
    return _mm256_srli_epi16(a, kBits);
  }
  /// a0 b0 + a1 b1 in each 32 bits, signed halves.
  static V multiply_pairs(V a, V b) noexcept { return _mm256_madd_epi16(a, b); }
  /// Low halves of 64 bits become the high ones.
  static V even32(V a) noexcept { return _mm256_slli_epi64(a, 32); }
  static V low32(V a) noexcept { return _mm256_blend_epi32(a, zero(), 0xaa); }
  static bool any(V a) noexcept { return _mm256_testz_si256(a, a) == 0; }
  /// (a b + 2^14) / 2^15 in each 16 bits.
  static V multiply_round(V a, V b) noexcept { return _mm256_mulhrs_epi16(a, b); }

  /// The densities index and index + 1 of each of 8 indices.
  static V load_pairs(const std::uint16_t* density, const std::uint32_t* index) noexcept {
    return _mm256_setr_m128i(load_four_pairs(density, index), load_four_pairs(density, index + 4));
  }

  static V gather32(const std::uint32_t* table, V index) noexcept {
    return _mm256_i32gather_epi32(reinterpret_cast<const int*>(table), index, 4);
  }
  /// 0, 1, 2 .. in 32 bits each.
  static V count32() noexcept { return _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7); }
  /// 16-bit entries as 32 bits each, without sign, and back.
  static V widen16(const void* p) noexcept { return _mm256_cvtepu16_epi32(load4(p)); }
  static V widen8(const std::uint8_t* p) noexcept {
    return _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p)));
  }
  static void narrow16(std::uint16_t* p, V a) noexcept {
    const V low = _mm256_permute4x64_epi64(_mm256_packus_epi32(a, a), 0x08);
    store4(p, _mm256_castsi256_si128(low));
  }

  static V bit_and(V a, V b) noexcept { return _mm256_and_si256(a, b); }
  static V bit_or(V a, V b) noexcept { return _mm256_or_si256(a, b); }
  static V bit_xor(V a, V b) noexcept { return _mm256_xor_si256(a, b); }
  static V unpack_low(V a, V b) noexcept { return _mm256_unpacklo_epi16(a, b); }
  static V unpack_high(V a, V b) noexcept { return _mm256_unpackhi_epi16(a, b); }

  static V add_where(V sum, std::uint32_t bits, V w) noexcept {
    const V own = _mm256_setr_epi16(1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192,
                                    16384, -32768);
    const V chosen = _mm256_cmpeq_epi16(bit_and(set16(static_cast<int>(bits)), own), own);
    return add16(sum, bit_and(w, chosen));
  }
  static V zero_where_equal(V kept, V a, V b) noexcept {
    return _mm256_andnot_si256(_mm256_cmpeq_epi16(a, b), kept);
  }
  static std::uint32_t not_zero32(V a) noexcept {
    const V empty = _mm256_cmpeq_epi32(a, zero());
    return ~static_cast<std::uint32_t>(_mm256_movemask_ps(_mm256_castsi256_ps(empty))) & 0xff;
  }
  static std::uint32_t not_zero16(V a) noexcept {
    const V empty = _mm256_cmpeq_epi16(a, zero());
    const V bytes = _mm256_permute4x64_epi64(_mm256_packs_epi16(empty, zero()), 0xd8);
    return ~static_cast<std::uint32_t>(_mm256_movemask_epi8(bytes)) & 0xffff;
  }
  /// `high` plus the carry out of `part` + something = `sum`.
  static V add_carry(V high, V sum, V part) noexcept {
    const V no_carry = _mm256_cmpeq_epi16(_mm256_max_epu16(sum, part), sum);
    return add16(high, _mm256_andnot_si256(no_carry, set16(1)));
  }
  /// Sums of entries i and i + 4 as 64 bits.
  static V widened(V a) noexcept {
    return add64(_mm256_cvtepi32_epi64(_mm256_castsi256_si128(a)),
                 _mm256_cvtepi32_epi64(_mm256_extracti128_si256(a, 1)));
  }
  static std::int64_t sum64(V a) noexcept {
    alignas(32) std::int64_t part[4];
    store(part, a);
    return part[0] + part[1] + part[2] + part[3];
  }

  /// Does not use `rho`: the box does not mark the entries beyond it.
  static void write_loss(std::uint16_t* density, std::ptrdiff_t begin, std::ptrdiff_t count,
                         V /*rho*/, V loss, std::uint32_t lost) noexcept {
    write_whole<Simd>(density, begin, count, loss, lost);
  }

  /// out[i][e] = in[e][i].
  static void transpose4(const std::uint32_t (&in)[4][16], std::uint32_t (*out)[4]) noexcept {
    for (int from = 0; from < 16; from += 8) {
      const V a = load(in[0] + from), b = load(in[1] + from), c = load(in[2] + from),
              d = load(in[3] + from);
      const V ab_low = _mm256_unpacklo_epi32(a, b), ab_high = _mm256_unpackhi_epi32(a, b);
      const V cd_low = _mm256_unpacklo_epi32(c, d), cd_high = _mm256_unpackhi_epi32(c, d);
      const V row[4] = {
          _mm256_unpacklo_epi64(ab_low, cd_low), _mm256_unpackhi_epi64(ab_low, cd_low),
          _mm256_unpacklo_epi64(ab_high, cd_high), _mm256_unpackhi_epi64(ab_high, cd_high)};
      for (int k = 0; k < 4; ++k) {  // row[k] holds entries k and k + 4
        store4(out[from + k], _mm256_castsi256_si128(row[k]));
        store4(out[from + k + 4], _mm256_extracti128_si256(row[k], 1));
      }
    }
  }
  static void store4(void* p, __m128i a) noexcept { _mm_storeu_si128(static_cast<__m128i*>(p), a); }
  static __m128i load4(const void* p) noexcept {
    return _mm_loadu_si128(static_cast<const __m128i*>(p));
  }

  /// Adds one cell's gradients times their weights: two edges of two voxels in each half as x, y,
  /// z, 0. Reads four bytes beyond each second voxel.
  static void add_cell(V& sum, const std::int16_t* g, std::ptrdiff_t row, std::ptrdiff_t plane,
                       const std::uint32_t (&weight)[4]) noexcept {
    const V by_axis = _mm256_broadcastsi128_si256(
        _mm_setr_epi8(0, 1, 6, 7, 2, 3, 8, 9, 4, 5, 10, 11, -1, -1, -1, -1));
    const V near_edges = _mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1);
    const V far_edges = _mm256_setr_epi32(2, 2, 2, 2, 3, 3, 3, 3);
    const V weights = _mm256_broadcastsi128_si256(load4(weight));
    const V near = _mm256_inserti128_si256(_mm256_castsi128_si256(load4(g)), load4(g + row), 1);
    const V far = _mm256_inserti128_si256(_mm256_castsi128_si256(load4(g + plane)),
                                          load4(g + plane + row), 1);
    multiply_add(sum, _mm256_shuffle_epi8(near, by_axis),
                 _mm256_permutevar8x32_epi32(weights, near_edges));
    multiply_add(sum, _mm256_shuffle_epi8(far, by_axis),
                 _mm256_permutevar8x32_epi32(weights, far_edges));
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

const KernelSet kAvx2Set = the_set<kAvx2Shape>();

}  // namespace kerf
