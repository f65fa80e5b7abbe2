// SPDX-License-Identifier: Apache-2.0

#include "visualizer/cast/cast_kernels.hpp"
#include "visualizer/cast/simd/avx512_lanes.hpp"
#include "visualizer/cast/simd/lane_loads.hpp"

// AVX-512, with loads for single lanes.

namespace kerf {
namespace {

struct Simd : Avx512 {
  template <int kEntryBytes>
  static I gather_bytes(const void* p, I at) noexcept {
    const Lanes lane(at);
    const auto load = [&](int i) { return load_bytes(p, lane.at[i], kEntryBytes); };
    return (I)_mm512_setr_epi32(load(0), load(1), load(2), load(3), load(4), load(5), load(6),
                                load(7), load(8), load(9), load(10), load(11), load(12), load(13),
                                load(14), load(15));
  }
  template <int kEntryBytes>
  static void gather_two(const void* p, I at, I& first, I& second) noexcept {
    const Lanes lane(at);
    const auto pair = [&](int i) { return load_pairs(p, lane.at[i], lane.at[i + 1], kEntryBytes); };
    const F left = joined(pair(0), pair(4), pair(8), pair(12));
    const F right = joined(pair(2), pair(6), pair(10), pair(14));
    first = bits(_mm512_shuffle_ps(left, right, 0x88));
    second = bits(_mm512_shuffle_ps(left, right, 0xdd));
  }
};

}  // namespace
}  // namespace kerf

#include "visualizer/cast/simd/packet_blend.hpp"
#include "visualizer/cast/simd/packet_iso.hpp"
#include "visualizer/cast/simd/packet_redraw.hpp"

namespace kerf {

const CastKernels kCastAvx512{"avx512", cast_iso, cast_blend, cast_rays_touch,
                              cast_shading_touches};

}  // namespace kerf
