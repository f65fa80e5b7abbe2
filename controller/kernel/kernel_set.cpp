// SPDX-License-Identifier: Apache-2.0
#include "controller/kernel/kernel_set.hpp"

#include "shared/numeric/hidden_set.hpp"

namespace kerf {

#if defined(KERF_X86_KERNELS)

namespace {

bool has_avx2() noexcept {
  return __builtin_cpu_supports("avx2") != 0 && !hidden_set(kAvx2Set.name);
}

bool has_avx512() noexcept {
  return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512bw") != 0 &&
         __builtin_cpu_supports("avx512vl") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
         __builtin_cpu_supports("avx512vnni") != 0 && !hidden_set(kAvx512Set.name);
}

}  // namespace

const KernelSet* const* kernel_sets() noexcept {
  // [avx512][avx2]; the rest of a list is null.
  static constexpr const KernelSet* kSets[2][2][4] = {
      {{&kScalarSet}, {&kAvx2Set, &kScalarSet}},
      {{&kAvx512Set, &kScalarSet}, {&kAvx512Set, &kAvx2Set, &kScalarSet}}};
  return kSets[has_avx512() ? 1 : 0][has_avx2() ? 1 : 0];
}

#elif defined(KERF_NEON_KERNELS)

// NEON is part of every aarch64.
const KernelSet* const* kernel_sets() noexcept {
  static constexpr const KernelSet* kSets[] = {&kNeonSet, &kScalarSet, nullptr};
  return hidden_set(kNeonSet.name) ? kSets + 1 : kSets;
}

#elif defined(KERF_WASM_KERNELS)

extern const KernelSet kSimd128Set;

// A module with SIMD128 starts only where that is there.
const KernelSet* const* kernel_sets() noexcept {
  static constexpr const KernelSet* kSets[] = {&kSimd128Set, &kScalarSet, nullptr};
  return kSets;
}

#else

const KernelSet* const* kernel_sets() noexcept {
  static constexpr const KernelSet* kSets[] = {&kScalarSet, nullptr};
  return kSets;
}

#endif

}  // namespace kerf
