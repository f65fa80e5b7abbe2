// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "visualizer/scene/filter_kernels.hpp"

// For the files that define `Simd` only, which has `F`, one of the compilers' vectors of float, and
// its square root. No library function: the files are compiled for instructions that other machines
// lack, and the linker keeps one copy of an inline function for all.

namespace kerf {
namespace {

using F = Simd::F;
constexpr int kAtOnce = static_cast<int>(sizeof(F) / sizeof(float));
static_assert(kFilterLanes % kAtOnce == 0);
constexpr int kMostTaps = 21;  // `AxisTaps`

inline F loaded(const float* from) {
  F to;
  __builtin_memcpy(&to, from, sizeof(F));
  return to;
}

inline void store(float* to, F from) {
  __builtin_memcpy(to, &from, sizeof(F));
}

/// `kKnown` is the reach, so that a compiler unrolls the sum, or 0.
template <int kKnown>
void sum_of(const FilterRows& filter) {
  const int reach = kKnown > 0 ? kKnown : filter.reach;
  float own[kMostTaps];  // which no result overwrites: they stay in registers
  float* const taps = own + reach;
  for (int i = -reach; i <= reach; ++i) taps[i] = filter.taps[i];
  const std::ptrdiff_t stride = filter.stride;
  for (int row = 0; row < filter.rows; ++row) {
    const float* const in = filter.in + row * filter.in_pitch;
    float* const out = filter.out + row * filter.out_pitch;
    for (int x = 0; x < filter.count; x += kAtOnce) {
      F sum = taps[0] * loaded(in + x);
      for (int i = 1; i <= reach; ++i) {
        sum += taps[i] * loaded(in + x + i * stride) + taps[-i] * loaded(in + x - i * stride);
      }
      store(out + x, sum);
    }
  }
}

/// farid5 and the wide filter of cubes are what most volumes have.
void sum_rows(const FilterRows& filter) {
  if (filter.reach == 2) return sum_of<2>(filter);
  if (filter.reach == 7) return sum_of<7>(filter);
  sum_of<0>(filter);
}

struct Direction {
  F x, y, z;
};

inline Direction loaded(const float* const (&from)[3], const float (&scale)[3], int x) {
  return {scale[0] * loaded(from[0] + x), scale[1] * loaded(from[1] + x),
          scale[2] * loaded(from[2] + x)};
}

inline F dot(const Direction& a, const Direction& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// As glm::mix.
inline F mixed(F own, F other, F part) {
  return own * (1.0F - part) + other * part;
}

void adapt_row(const AdaptedRow& row) {
  const float* const narrow[3] = {row.narrow[0], row.narrow[1], row.narrow[2]};
  for (int x = 0; x < row.count; x += kAtOnce) {
    const Direction own = loaded(narrow, row.narrow_scale, x);
    const Direction other = loaded(row.wide, row.wide_scale, x);
    const F zero{}, one = zero + 1.0F;
    const F own_2 = dot(own, own), other_2 = dot(other, other);
    const F cosine = dot(own, other) / Simd::sqrt(own_2 * other_2);
    F part = (cosine - kAdaptedDiffer) / (kAdaptedAgree - kAdaptedDiffer);
    part = part < zero ? zero : part;
    part = one < part ? one : part;
    // None where one of them has no direction.
    part = own_2 > zero ? part : zero;
    part = other_2 > zero ? part : zero;
    const F length = Simd::sqrt(own_2);
    const F longer = length / Simd::sqrt(other_2);
    const Direction turned{mixed(own.x, other.x * longer, part),
                           mixed(own.y, other.y * longer, part),
                           mixed(own.z, other.z * longer, part)};
    const F rest = length / Simd::sqrt(dot(turned, turned));
    const auto result = [&](F from, F to) { return part > zero ? to * rest : from; };
    store(row.narrow[0] + x, result(own.x, turned.x));
    store(row.narrow[1] + x, result(own.y, turned.y));
    store(row.narrow[2] + x, result(own.z, turned.z));
  }
}

}  // namespace
}  // namespace kerf
