// SPDX-License-Identifier: Apache-2.0

#include <immintrin.h>

#include "visualizer/scene/filter_kernels.hpp"

// Sixteen numbers at a time.

namespace kerf {
namespace {

struct Simd {
  using F = float __attribute__((vector_size(64)));
  static F sqrt(F a) noexcept { return (F)_mm512_sqrt_ps((__m512)a); }
};

}  // namespace
}  // namespace kerf

#include "visualizer/scene/simd/filter_rows.hpp"

namespace kerf {

const FilterKernels kFilterAvx512{"avx512", sum_rows, adapt_row};

}  // namespace kerf
