// SPDX-License-Identifier: Apache-2.0
#include "visualizer/cast/cast_kernels.hpp"

#include <array>
#include <cstddef>

#if defined(KERF_X86_CAST)
#include <cpuid.h>
#endif

#include "shared/numeric/hidden_set.hpp"

namespace kerf {
namespace {

using Sets = std::array<const CastKernels*, 5>;  // the fastest first; ends with a null

#if defined(KERF_X86_CAST)
/// Whether gather instructions beat loads for single lanes. They do on Intel processors that need
/// no mending against "Downfall" (CVE-2022-40982); these are those with AVX-VNNI.
bool gathers_quickly() noexcept {
  constexpr unsigned kAvxVnni = 1U << 4;
  unsigned eax = 0, ebx = 0, ecx = 0, edx = 0;
  return __builtin_cpu_is("intel") != 0 && __get_cpuid_count(7, 1, &eax, &ebx, &ecx, &edx) != 0 &&
         (eax & kAvxVnni) != 0;
}
#endif

Sets sets_of_this_machine() noexcept {
  Sets sets{};
  std::size_t count = 0;
#if defined(KERF_X86_CAST)
  if (__builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
      !hidden_set("avx512")) {
    const bool quickly = gathers_quickly();
    sets[count++] = quickly ? &kCastAvx512Gather : &kCastAvx512;
    sets[count++] = quickly ? &kCastAvx512 : &kCastAvx512Gather;
  }
  if (__builtin_cpu_supports("avx2") != 0 && !hidden_set("avx2")) sets[count++] = &kCastAvx2;
#endif
  sets[count] = &kCastScalar;
  return sets;
}

}  // namespace

const CastKernels* const* cast_kernels() noexcept {
  static const Sets kSets = sets_of_this_machine();
  return kSets.data();
}

}  // namespace kerf
