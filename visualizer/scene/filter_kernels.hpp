// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace kerf {

/// Numbers that the kernels compute together, in every set: rows of a box have room for a multiple
/// of them, and what lies beyond the row's end there is computed and means nothing.
inline constexpr int kFilterLanes = 16;

/// Cosines of the angles between the narrow and the wide gradient, up to which the wide one's
/// direction is taken and from which on the narrow one's.
inline constexpr float kAdaptedAgree = 0.985F;   // of 10 degrees
inline constexpr float kAdaptedDiffer = 0.940F;  // of 20

/// A filter along one axis, over rows of numbers.
struct FilterRows {
  const float* taps = nullptr;  ///< the middle one; `reach` more before and after it
  int reach = 0;
  std::ptrdiff_t stride = 1;  ///< between two numbers along the axis
  const float* in = nullptr;
  float* out = nullptr;
  std::ptrdiff_t in_pitch = 0, out_pitch = 0;  ///< between two rows
  int rows = 0, count = 0;                     ///< `count` numbers of each
};

/// A part of a row of gradients: one row of numbers and one factor for each axis.
struct AdaptedRow {
  float* narrow[3] = {};  ///< becomes the result, times its factor
  const float* wide[3] = {};
  float narrow_scale[3] = {}, wide_scale[3] = {};
  int count = 0;
};

/// The kernels of one instruction set that filter a volume (`fill_gradients`): plain pointers, as
/// in `CastVolumeJob`. All sets give the same bits: each number is computed by itself, with the
/// same operations in the same order, and none of them is fused. `count` is a multiple of
/// `kFilterLanes`.
struct FilterKernels {
  const char* name;
  /// out[i] = t[0] in[i] + (t[1] in[i + stride] + t[-1] in[i - stride]) + ...
  void (*sum)(const FilterRows& filter);
  /// The direction of `wide` where it hardly differs from that of `narrow`: steps of voxels turn
  /// the narrow one by 9 degrees at 99 of 100 points and the wide one by 2, an edge turns one
  /// farther. Length and all else is the narrow one's.
  void (*adapt)(const AdaptedRow& row);
};

/// What this machine can run and is not hidden (shared/numeric/hidden_set.hpp), the fastest first;
/// ends with the scalar set and a null.
[[nodiscard]] const FilterKernels* const* filter_kernels() noexcept;

extern const FilterKernels kFilterAvx512;
extern const FilterKernels kFilterAvx2;
extern const FilterKernels kFilterScalar;

}  // namespace kerf
