// SPDX-License-Identifier: Apache-2.0
// SIMD128 of WebAssembly: 8 densities at a time.
#include <cstddef>
#include <cstdint>

#include <wasm_simd128.h>

#include "controller/kernel/sets/set_common.hpp"

namespace kerf {
namespace {

struct Simd {
  using V = v128_t;
  static constexpr int kLanes = 8;

  static V load(const void* p) noexcept { return wasm_v128_load(p); }
  static void store(void* p, V a) noexcept { wasm_v128_store(p, a); }
  static V zero() noexcept { return wasm_i16x8_const_splat(0); }
  static V set16(int a) noexcept { return wasm_i16x8_splat(static_cast<std::int16_t>(a)); }
  static V set32(int a) noexcept { return wasm_i32x4_splat(a); }
  static V pair16(int a, int b) noexcept { return set32((a & 0xffff) | b * 65536); }

  /// sum += a0 b0 + a1 b1 in each 32 bits.
  static void multiply_add(V& sum, V a, V b) noexcept {
    sum = wasm_i32x4_add(sum, wasm_i32x4_dot_i16x8(a, b));
  }
  static V multiply_even(V a, V b) noexcept {
    return wasm_i64x2_extmul_low_i32x4(wasm_i32x4_shuffle(a, a, 0, 2, 0, 2),
                                       wasm_i32x4_shuffle(b, b, 0, 2, 0, 2));
  }
  static V odd32(V a) noexcept { return wasm_u64x2_shr(a, 32); }
  static V multiply32(V a, V b) noexcept { return wasm_i32x4_mul(a, b); }
  static V multiply_high(V a, V b) noexcept {  // unsigned
    return wasm_i16x8_shuffle(wasm_u32x4_extmul_low_u16x8(a, b), wasm_u32x4_extmul_high_u16x8(a, b),
                              1, 3, 5, 7, 9, 11, 13, 15);
  }
  static V multiply_low(V a, V b) noexcept { return wasm_i16x8_mul(a, b); }

  static V add16(V a, V b) noexcept { return wasm_i16x8_add(a, b); }
  static V sub16(V a, V b) noexcept { return wasm_i16x8_sub(a, b); }
  static V add32(V a, V b) noexcept { return wasm_i32x4_add(a, b); }
  static V sub32(V a, V b) noexcept { return wasm_i32x4_sub(a, b); }
  static V add64(V a, V b) noexcept { return wasm_i64x2_add(a, b); }
  template <int kBits>
  static V sra32(V a) noexcept {
    return wasm_i32x4_shr(a, kBits);
  }
  template <int kBits>
  static V srl32(V a) noexcept {
    return wasm_u32x4_shr(a, kBits);
  }
  template <int kBits>
  static V sll32(V a) noexcept {
    return wasm_i32x4_shl(a, kBits);
  }
  template <int kBits>
  static V srl16(V a) noexcept {
    return wasm_u16x8_shr(a, kBits);
  }
  /// `n` is below 32, for the instruction takes it modulo 32.
  static V srl32(V a, int n) noexcept { return wasm_u32x4_shr(a, static_cast<std::uint32_t>(n)); }
  static V min32(V a, V b) noexcept { return wasm_i32x4_min(a, b); }
  static V max32(V a, V b) noexcept { return wasm_i32x4_max(a, b); }
  /// a0 b0 + a1 b1 in each 32 bits, signed halves.
  static V multiply_pairs(V a, V b) noexcept { return wasm_i32x4_dot_i16x8(a, b); }
  /// (a b + 2^14) / 2^15 in each 16 bits; a and b are not both -2^15.
  static V multiply_round(V a, V b) noexcept { return wasm_i16x8_q15mulr_sat(a, b); }
  static V low32(V a) noexcept { return bit_and(a, wasm_i64x2_const_splat(0xffffffff)); }
  static bool any(V a) noexcept { return wasm_v128_any_true(a); }
  /// 0, 1, 2, 3 in 32 bits each.
  static V count32() noexcept { return wasm_i32x4_const(0, 1, 2, 3); }
  /// The densities index and index + 1 of each of 4 indices.
  static V load_pairs(const std::uint16_t* density, const std::uint32_t* index) noexcept {
    const V one = wasm_v128_load32_zero(density + index[0]);
    const V two = wasm_v128_load32_lane(density + index[1], one, 1);
    const V three = wasm_v128_load32_lane(density + index[2], two, 2);
    return wasm_v128_load32_lane(density + index[3], three, 3);
  }

  static V times512(V a) noexcept { return wasm_i64x2_shl(a, 9); }
  // The instruction takes its count modulo 16.
  static V shift_left16(V a, int n) noexcept {
    return is_within(n) ? wasm_i16x8_shl(a, static_cast<std::uint32_t>(n)) : zero();
  }
  static V shift_right16(V a, int n) noexcept {
    return is_within(n) ? wasm_u16x8_shr(a, static_cast<std::uint32_t>(n)) : zero();
  }
  static V bit_and(V a, V b) noexcept { return wasm_v128_and(a, b); }
  static V bit_or(V a, V b) noexcept { return wasm_v128_or(a, b); }
  static V bit_xor(V a, V b) noexcept { return wasm_v128_xor(a, b); }
  static V unpack_low(V a, V b) noexcept {
    return wasm_i16x8_shuffle(a, b, 0, 8, 1, 9, 2, 10, 3, 11);
  }
  static V unpack_high(V a, V b) noexcept {
    return wasm_i16x8_shuffle(a, b, 4, 12, 5, 13, 6, 14, 7, 15);
  }

  static V add_where(V sum, std::uint32_t chosen, V w) noexcept {
    const V bits = bit_and(wasm_i16x8_splat(static_cast<std::int16_t>(chosen)), own_bit());
    return add16(sum, bit_and(w, wasm_i16x8_eq(bits, own_bit())));
  }
  static V zero_where_equal(V kept, V a, V b) noexcept {
    return wasm_v128_andnot(kept, wasm_i16x8_eq(a, b));
  }
  static std::uint32_t not_zero16(V a) noexcept {
    return wasm_i16x8_bitmask(wasm_i16x8_ne(a, zero()));
  }
  /// `high` plus the carry out of `part` + something = `sum`.
  static V add_carry(V high, V sum, V part) noexcept {
    return sub16(high, wasm_u16x8_lt(sum, part));
  }
  /// Sums of neighbours as 64 bits.
  static V widened(V a) noexcept {
    return add64(wasm_i64x2_shr(wasm_i64x2_shl(a, 32), 32), wasm_i64x2_shr(a, 32));
  }
  static std::int64_t sum64(V a) noexcept {
    return wasm_i64x2_extract_lane(a, 0) + wasm_i64x2_extract_lane(a, 1);
  }

  /// Does not use `rho`: the box does not mark the entries beyond it.
  static void write_loss(std::uint16_t* density, std::ptrdiff_t begin, std::ptrdiff_t count,
                         V /*rho*/, V loss, std::uint32_t lost) noexcept {
    write_whole<Simd>(density, begin, count, loss, lost);
  }

 private:
  static bool is_within(int n) noexcept { return n >= 0 && n < 16; }
  static V own_bit() noexcept { return wasm_i16x8_const(1, 2, 4, 8, 16, 32, 64, 128); }
};

}  // namespace
}  // namespace kerf

#include "controller/kernel/sets/correlate_vector.hpp"
#include "controller/kernel/sets/point_vector.hpp"
#include "controller/kernel/sets/scalar_loops.hpp"
#include "controller/kernel/sets/set_table.hpp"

namespace kerf {

// For kernel_set.cpp, and nothing else.
extern const KernelSet kSimd128Set;
const KernelSet kSimd128Set = the_set<kSimd128Shape>();

}  // namespace kerf
