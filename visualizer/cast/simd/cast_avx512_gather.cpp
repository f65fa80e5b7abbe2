// SPDX-License-Identifier: Apache-2.0

#include "visualizer/cast/cast_kernels.hpp"
#include "visualizer/cast/simd/avx512_lanes.hpp"

// AVX-512, with its gather instructions: for processors that are quick at them.

namespace kerf {
namespace {

struct Simd : Avx512 {
  template <int kEntryBytes>
  static I gather_bytes(const void* p, I at) noexcept {
    return (I)_mm512_i32gather_epi32((__m512i)at, p, kEntryBytes);
  }
  template <int kEntryBytes>
  static void gather_two(const void* p, I at, I& first, I& second) noexcept {
    const __m512i low = _mm512_i32gather_epi64(_mm512_castsi512_si256((__m512i)at), p, kEntryBytes);
    const __m512i high =
        _mm512_i32gather_epi64(_mm512_extracti64x4_epi64((__m512i)at, 1), p, kEntryBytes);
    const I even = {0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30};
    first = (I)_mm512_permutex2var_epi32(low, (__m512i)even, high);
    second = (I)_mm512_permutex2var_epi32(low, (__m512i)(even + 1), high);
  }
};

}  // namespace
}  // namespace kerf

#include "visualizer/cast/simd/packet_blend.hpp"
#include "visualizer/cast/simd/packet_iso.hpp"
#include "visualizer/cast/simd/packet_redraw.hpp"

namespace kerf {

const CastKernels kCastAvx512Gather{"avx512-gather", cast_iso, cast_blend, cast_rays_touch,
                                    cast_shading_touches};

}  // namespace kerf
