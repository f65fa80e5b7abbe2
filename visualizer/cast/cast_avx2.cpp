// SPDX-License-Identifier: Apache-2.0
// AVX2: packets of 4x4 rays, each value in two registers.
#include "visualizer/cast/avx2_lanes.hpp"
#include "visualizer/cast/cast_job.hpp"
#include "visualizer/cast/twice.hpp"

namespace kerf {
namespace {

using Simd = Twice<Avx2>;

}  // namespace
}  // namespace kerf

#include "visualizer/cast/packet_blend.hpp"
#include "visualizer/cast/packet_dirty.hpp"
#include "visualizer/cast/packet_iso.hpp"

namespace kerf {

const CastKernels kCastAvx2{"avx2", cast_iso, cast_blend, cast_rays_touch, cast_shading_touches};

}  // namespace kerf
