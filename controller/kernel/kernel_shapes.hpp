// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace kerf {

/// What a plan and its costs depend on in a `KernelSet`: a scene can be planned for any set, on any
/// processor.
struct KernelShape {
  const char* name;
  std::int32_t lanes;  ///< `KernelSet::lanes`
  bool can_fuse;       ///< `KernelSet::can_fuse`
};

inline constexpr KernelShape kAvx512Shape{"avx512", 32, true};
inline constexpr KernelShape kAvx2Shape{"avx2", 16, false};
inline constexpr KernelShape kNeonShape{"neon", 8, false};
inline constexpr KernelShape kSimd128Shape{"simd128", 8, false};
inline constexpr KernelShape kScalarShape{"scalar", 16, false};

/// Shapes of all instruction sets that kerf supports, on any processor.
inline constexpr KernelShape kKernelShapes[] = {kAvx512Shape, kAvx2Shape, kNeonShape, kSimd128Shape,
                                                kScalarShape};

}  // namespace kerf
