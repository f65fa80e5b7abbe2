// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "shared/numeric/fixed.hpp"

namespace kerf {

/// The number types a kernel is written in. One text serves all three bundles; `FixedNumbers` runs
/// in the loop by default, `DoubleNumbers` is the truth in tests.
///
///   Real      mm, N, voxels             Unit      sines, rotation entries, |x| <= 1
///   Angle     radians, |x| < 8          Ratio     voxels per mm, |x| < 128
///   Step      voxels per tool pitch     Gradient  stored density gradient, density steps per voxel
///   Weight    trilinear weight, 0..kWeightOne    Sample  interpolated value, 8 kept bits in fixed
///   Sum       exact sums, never saturate: wide enough, order does not matter in fixed
///   Energy    N mm (= mJ) with 32 fraction bits in fixed
struct FixedNumbers {
  static constexpr const char* kName = "fixed";
  static constexpr bool kIsFixed = true;
  using Real = Q16;
  using Unit = Q30;
  using Angle = Fixed<28>;
  using Ratio = Fixed<24>;
  using Step = std::int32_t;      // Q11.20
  using Gradient = std::int16_t;  // L1 norm of each kernel <= 0.5, so it cannot overflow
  using Weight = std::int32_t;    // Q0.15, stored as u16 where memory counts
  using Sample = std::int32_t;    // 8 kept bits
  using Sum = std::int64_t;
  using Energy = std::int64_t;
  static constexpr Weight kWeightOne = 1 << 15;
  static constexpr Step kStepOne = 1 << 20;
  static constexpr Sample kSampleOne = 1 << 8;
};

template <std::floating_point S>
struct FloatingNumbers {
  static constexpr const char* kName = sizeof(S) == 4 ? "float" : "double";
  static constexpr bool kIsFixed = false;
  using Real = S;
  using Unit = S;
  using Angle = S;
  using Ratio = S;
  using Step = S;
  using Gradient = S;
  using Weight = S;
  using Sample = S;
  using Sum = S;
  using Energy = S;
  static constexpr Weight kWeightOne = S(1);
  static constexpr Step kStepOne = S(1);
  static constexpr Sample kSampleOne = S(1);
};
using FloatNumbers = FloatingNumbers<float>;
using DoubleNumbers = FloatingNumbers<double>;

}  // namespace kerf
