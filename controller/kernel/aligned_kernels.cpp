// SPDX-License-Identifier: Apache-2.0
#include "controller/kernel/aligned_kernels.hpp"

namespace kerf {
namespace {

struct Choice {
  const AlignedKernels* sets[4] = {};

  Choice() noexcept {
    std::size_t count = 0;
#if defined(KERF_X86_KERNELS)
    if (__builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512bw") != 0 &&
        __builtin_cpu_supports("avx512vl") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
        __builtin_cpu_supports("avx512vnni") != 0) {
      sets[count++] = &kAlignedAvx512;
    }
    if (__builtin_cpu_supports("avx2") != 0) sets[count++] = &kAlignedAvx2;
#endif
    sets[count] = &kAlignedScalar;
  }
};

}  // namespace

const AlignedKernels* const* aligned_kernels() noexcept {
  static const Choice kChoice;
  return kChoice.sets;
}

}  // namespace kerf
