// SPDX-License-Identifier: Apache-2.0
#include <cstddef>

#include "visualizer/cast/cast_job.hpp"

namespace kerf {
namespace {

// The fastest first; what a machine can run is a tail of this list.
constexpr const CastKernels* kSets[] = {
#if defined(KERF_X86_CAST)
    &kCastAvx512, &kCastAvx2,
#endif
    &kCastScalar, nullptr};

std::size_t sets_beyond_this_machine() noexcept {
#if defined(KERF_X86_CAST)
  if (__builtin_cpu_supports("avx2") == 0) return 2;
  const bool has_avx512 =
      __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0;
  return has_avx512 ? 0 : 1;
#else
  return 0;
#endif
}

}  // namespace

const CastKernels* const* cast_kernels() noexcept {
  return kSets + sets_beyond_this_machine();
}

}  // namespace kerf
