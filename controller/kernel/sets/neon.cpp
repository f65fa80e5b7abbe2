// SPDX-License-Identifier: Apache-2.0
// NEON, which every aarch64 has: 8 densities at a time.
#include <cstddef>
#include <cstdint>

#include <arm_neon.h>

#include "controller/kernel/sets/set_common.hpp"

namespace kerf {
namespace {

struct Simd {
  using V = int16x8_t;
  static constexpr int kLanes = 8;

  static V load(const void* p) noexcept { return vld1q_s16(static_cast<const std::int16_t*>(p)); }
  static void store(void* p, V a) noexcept { vst1q_s16(static_cast<std::int16_t*>(p), a); }
  static V zero() noexcept { return vdupq_n_s16(0); }
  static V set16(int a) noexcept { return vdupq_n_s16(static_cast<std::int16_t>(a)); }
  static V set32(int a) noexcept { return from(vdupq_n_s32(a)); }
  static V pair16(int a, int b) noexcept { return set32((a & 0xffff) | b * 65536); }

  /// sum += a0 b0 + a1 b1 in each 32 bits.
  static void multiply_add(V& sum, V a, V b) noexcept {
    const int32x4_t low = vmull_s16(vget_low_s16(a), vget_low_s16(b));
    sum = from(vaddq_s32(as32(sum), vpaddq_s32(low, vmull_high_s16(a, b))));
  }
  static V multiply_even(V a, V b) noexcept {
    return from(vmull_s32(vmovn_s64(as64(a)), vmovn_s64(as64(b))));
  }
  static V odd32(V a) noexcept { return from(vshrq_n_s64(as64(a), 32)); }
  static V multiply32(V a, V b) noexcept { return from(vmulq_s32(as32(a), as32(b))); }
  static V multiply_high(V a, V b) noexcept {  // unsigned
    const uint32x4_t low = vmull_u16(vget_low_u16(bits(a)), vget_low_u16(bits(b)));
    const uint32x4_t high = vmull_high_u16(bits(a), bits(b));
    return from(vuzp2q_u16(vreinterpretq_u16_u32(low), vreinterpretq_u16_u32(high)));
  }
  static V multiply_low(V a, V b) noexcept { return vmulq_s16(a, b); }

  static V add16(V a, V b) noexcept { return vaddq_s16(a, b); }
  static V sub16(V a, V b) noexcept { return vsubq_s16(a, b); }
  static V add32(V a, V b) noexcept { return from(vaddq_s32(as32(a), as32(b))); }
  static V sub32(V a, V b) noexcept { return from(vsubq_s32(as32(a), as32(b))); }
  static V add64(V a, V b) noexcept { return from(vaddq_s64(as64(a), as64(b))); }
  static V times512(V a) noexcept { return from(vshlq_n_s64(as64(a), 9)); }
  static V shift_left16(V a, int n) noexcept { return from(vshlq_u16(bits(a), set16(width(n)))); }
  static V shift_right16(V a, int n) noexcept { return from(vshlq_u16(bits(a), set16(-width(n)))); }
  static V bit_and(V a, V b) noexcept { return vandq_s16(a, b); }
  static V bit_or(V a, V b) noexcept { return vorrq_s16(a, b); }
  static V bit_xor(V a, V b) noexcept { return veorq_s16(a, b); }
  static V unpack_low(V a, V b) noexcept { return vzip1q_s16(a, b); }
  static V unpack_high(V a, V b) noexcept { return vzip2q_s16(a, b); }

  static V add_where(V sum, std::uint32_t chosen, V w) noexcept {
    const uint16x8_t mask = vtstq_u16(vdupq_n_u16(static_cast<std::uint16_t>(chosen)), own_bit());
    return add16(sum, bit_and(w, from(mask)));
  }
  static V zero_where_equal(V kept, V a, V b) noexcept {
    return from(vbicq_u16(bits(kept), vceqq_s16(a, b)));
  }
  static std::uint32_t not_zero16(V a) noexcept {
    return vaddvq_u16(vandq_u16(vtstq_s16(a, a), own_bit()));
  }
  /// `high` plus the carry out of `part` + something = `sum`.
  static V add_carry(V high, V sum, V part) noexcept {
    return sub16(high, from(vcltq_u16(bits(sum), bits(part))));
  }
  /// Sums of neighbours as 64 bits.
  static V widened(V a) noexcept { return from(vpaddlq_s32(as32(a))); }
  static std::int64_t sum64(V a) noexcept { return vaddvq_s64(as64(a)); }

  /// Does not use `rho`: the box does not mark the entries beyond it.
  static void write_loss(std::uint16_t* density, std::ptrdiff_t begin, std::ptrdiff_t count,
                         V /*rho*/, V loss, std::uint32_t lost) noexcept {
    write_whole<Simd>(density, begin, count, loss, lost);
  }

 private:
  static V from(int32x4_t a) noexcept { return vreinterpretq_s16_s32(a); }
  static V from(int64x2_t a) noexcept { return vreinterpretq_s16_s64(a); }
  static V from(uint16x8_t a) noexcept { return vreinterpretq_s16_u16(a); }
  static int32x4_t as32(V a) noexcept { return vreinterpretq_s32_s16(a); }
  static int64x2_t as64(V a) noexcept { return vreinterpretq_s64_s16(a); }
  static uint16x8_t bits(V a) noexcept { return vreinterpretq_u16_s16(a); }

  /// 16 shifts everything out, either way; a negative count would shift the other way.
  static int width(int n) noexcept { return n < 0 || n > 16 ? 16 : n; }
  static uint16x8_t own_bit() noexcept {
    constexpr std::uint16_t kBits[kLanes] = {1, 2, 4, 8, 16, 32, 64, 128};
    return vld1q_u16(kBits);
  }
};

}  // namespace
}  // namespace kerf

#include "controller/kernel/sets/correlate_vector.hpp"
#include "controller/kernel/sets/scalar_loops.hpp"
#include "controller/kernel/sets/scalar_points.hpp"
#include "controller/kernel/sets/set_table.hpp"

namespace kerf {

const KernelSet kNeonSet = the_set<kNeonShape>();

}  // namespace kerf
