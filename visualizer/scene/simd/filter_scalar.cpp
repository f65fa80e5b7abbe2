// SPDX-License-Identifier: Apache-2.0

#include "visualizer/scene/filter_kernels.hpp"

// For any machine: both compilers have vectors of four floats for every processor, or take them
// one by one. The reference for the other sets.

namespace kerf {
namespace {

struct Simd {
  using F = float __attribute__((vector_size(16)));
  static F sqrt(F a) noexcept {
    return F{__builtin_sqrtf(a[0]), __builtin_sqrtf(a[1]), __builtin_sqrtf(a[2]),
             __builtin_sqrtf(a[3])};
  }
};

}  // namespace
}  // namespace kerf

#include "visualizer/scene/simd/filter_rows.hpp"

namespace kerf {

const FilterKernels kFilterScalar{"scalar", sum_rows, adapt_row};

}  // namespace kerf
