// SPDX-License-Identifier: Apache-2.0

#include <immintrin.h>

#include "visualizer/scene/filter_kernels.hpp"

// Eight numbers at a time.

namespace kerf {
namespace {

struct Simd {
  using F = float __attribute__((vector_size(32)));
  static F sqrt(F a) noexcept { return (F)_mm256_sqrt_ps((__m256)a); }
};

}  // namespace
}  // namespace kerf

#include "visualizer/scene/simd/filter_rows.hpp"

namespace kerf {

const FilterKernels kFilterAvx2{"avx2", sum_rows, adapt_row};

}  // namespace kerf
