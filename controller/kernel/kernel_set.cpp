// SPDX-License-Identifier: Apache-2.0
#include "controller/kernel/kernel_set.hpp"

namespace kerf {

#ifdef KERF_WASM_KERNELS
extern const KernelSet kSimd128Set;
#endif

namespace {

// The fastest first; the sets of a machine are a tail of this list.
constexpr const KernelSet* kSets[] = {
#if defined(KERF_X86_KERNELS)
    &kAvx512Set, &kAvx2Set,
#elif defined(KERF_NEON_KERNELS)
    &kNeonSet,
#elif defined(KERF_WASM_KERNELS)
    &kSimd128Set,
#endif
    &kScalarSet, nullptr};

std::size_t sets_beyond_this_machine() noexcept {
#if defined(KERF_X86_KERNELS)
  if (__builtin_cpu_supports("avx2") == 0) return 2;
  const bool has_avx512 =
      __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512bw") != 0 &&
      __builtin_cpu_supports("avx512vl") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
      __builtin_cpu_supports("avx512vnni") != 0;
  return has_avx512 ? 0 : 1;
#else
  return 0;  // NEON is part of every aarch64; a module with SIMD128 starts only where that is there
#endif
}

}  // namespace

const KernelSet* const* kernel_sets() noexcept {
  return kSets + sets_beyond_this_machine();
}

}  // namespace kerf
