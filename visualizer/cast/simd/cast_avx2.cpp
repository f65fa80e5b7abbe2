// SPDX-License-Identifier: Apache-2.0
// AVX2: packets of 4x4 rays, each value in two registers.
#include <cstdint>

#include <immintrin.h>

#include "visualizer/cast/cast_kernels.hpp"
#include "visualizer/cast/simd/lane_loads.hpp"

namespace kerf {
namespace {

/// Lanes of 4x2 rays.
struct Avx2 {
  using F = __m256;
  using I = std::int32_t __attribute__((vector_size(32)));
  using M = __m256;  ///< all bits or none
  static constexpr int kWide = 4, kHigh = 2;

  static F set(float a) noexcept { return _mm256_set1_ps(a); }
  static F lane_x() noexcept { return _mm256_setr_ps(0, 1, 2, 3, 0, 1, 2, 3); }
  static F lane_y() noexcept { return _mm256_setr_ps(0, 0, 0, 0, 1, 1, 1, 1); }
  static void store(void* p, F a) noexcept { _mm256_storeu_ps(static_cast<float*>(p), a); }
  static void store(void* p, I a) noexcept {
    _mm256_storeu_si256(static_cast<__m256i*>(p), (__m256i)a);
  }

  static I to_int(F a) noexcept { return (I)_mm256_cvttps_epi32(a); }
  static F to_float(I a) noexcept { return _mm256_cvtepi32_ps((__m256i)a); }
  static I bits(F a) noexcept { return (I)_mm256_castps_si256(a); }
  static F from_bits(I a) noexcept { return _mm256_castsi256_ps((__m256i)a); }
  static I high_half(I a) noexcept { return (I)_mm256_srli_epi32((__m256i)a, 16); }
  static F sqrt(F a) noexcept { return _mm256_sqrt_ps(a); }
  static F min(F a, F b) noexcept { return _mm256_min_ps(a, b); }
  static F max(F a, F b) noexcept { return _mm256_max_ps(a, b); }

  static M none() noexcept { return _mm256_setzero_ps(); }
  static M all() noexcept { return _mm256_castsi256_ps(_mm256_set1_epi32(-1)); }
  static M less(F a, F b) noexcept { return _mm256_cmp_ps(a, b, _CMP_LT_OQ); }
  static M equal(F a, F b) noexcept { return _mm256_cmp_ps(a, b, _CMP_EQ_OQ); }
  static M equal(I a, I b) noexcept {
    return _mm256_castsi256_ps(_mm256_cmpeq_epi32((__m256i)a, (__m256i)b));
  }
  static M both(M a, M b) noexcept { return _mm256_and_ps(a, b); }
  static M either(M a, M b) noexcept { return _mm256_or_ps(a, b); }
  static M but_not(M a, M b) noexcept { return _mm256_andnot_ps(b, a); }
  static bool any(M a) noexcept { return _mm256_movemask_ps(a) != 0; }
  static int count(M a) noexcept {
    return __builtin_popcount(static_cast<unsigned>(_mm256_movemask_ps(a)));
  }
  static F select(M m, F yes, F no) noexcept { return _mm256_blendv_ps(no, yes, m); }
  static I select(M m, I yes, I no) noexcept {
    return bits(_mm256_blendv_ps(from_bits(no), from_bits(yes), m));
  }

  template <int kEntryBytes>
  static I gather_bytes(const void* p, I at) noexcept {
    const Lanes lane(at);
    const auto load = [&](int i) { return load_bytes(p, lane.at[i], kEntryBytes); };
    return (I)_mm256_setr_epi32(load(0), load(1), load(2), load(3), load(4), load(5), load(6),
                                load(7));
  }
  template <int kEntryBytes>
  static void gather_two(const void* p, I at, I& first, I& second) noexcept {
    const Lanes lane(at);
    const auto pair = [&](int i) { return load_pairs(p, lane.at[i], lane.at[i + 1], kEntryBytes); };
    const F left = joined(pair(0), pair(4));
    const F right = joined(pair(2), pair(6));
    first = bits(_mm256_shuffle_ps(left, right, 0x88));
    second = bits(_mm256_shuffle_ps(left, right, 0xdd));
  }
  static void gather_four(const float* p, I at, F (&out)[4]) noexcept {
    const Lanes lane(at);
    const auto row = [&](int i) {
      return joined(_mm_loadu_ps(p + lane.at[i]), _mm_loadu_ps(p + lane.at[i + 4]));
    };
    const F row0 = row(0), row1 = row(1), row2 = row(2), row3 = row(3);
    const F low01 = _mm256_unpacklo_ps(row0, row1);
    const F low23 = _mm256_unpacklo_ps(row2, row3);
    const F high01 = _mm256_unpackhi_ps(row0, row1);
    const F high23 = _mm256_unpackhi_ps(row2, row3);
    out[0] = _mm256_shuffle_ps(low01, low23, 0x44);
    out[1] = _mm256_shuffle_ps(low01, low23, 0xee);
    out[2] = _mm256_shuffle_ps(high01, high23, 0x44);
    out[3] = _mm256_shuffle_ps(high01, high23, 0xee);
  }

 private:
  struct Lanes {
    explicit Lanes(I of) noexcept { store(at, of); }
    std::int32_t at[kWide * kHigh];
  };
  static F joined(__m128 low, __m128 high) noexcept {
    return _mm256_insertf128_ps(_mm256_castps128_ps256(low), high, 1);
  }
};

/// A `Simd` whose lanes are those of `Half` twice, one packet above the other. Each operation is
/// two that do not wait for one another: while a load, division or root of one packet is under way,
/// the other computes. Only if all of it is inlined: else the pairs travel through memory.
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
    friend I operator&(I a, I b) noexcept { return {a.low & b.low, a.high & b.high}; }
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

using Simd = Twice<Avx2>;

}  // namespace
}  // namespace kerf

#include "visualizer/cast/simd/packet_blend.hpp"
#include "visualizer/cast/simd/packet_iso.hpp"
#include "visualizer/cast/simd/packet_redraw.hpp"

namespace kerf {

const CastKernels kCastAvx2{"avx2", cast_iso, cast_blend, cast_rays_touch, cast_shading_touches};

}  // namespace kerf
