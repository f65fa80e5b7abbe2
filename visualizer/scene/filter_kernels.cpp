// SPDX-License-Identifier: Apache-2.0
#include "visualizer/scene/filter_kernels.hpp"

#include <array>

#include "shared/numeric/hidden_set.hpp"

namespace kerf {
namespace {

using FilterSets = std::array<const FilterKernels*, 4>;  // the fastest first; ends with a null

FilterSets filter_sets_of_this_machine() noexcept {
  FilterSets sets{};
  std::size_t count = 0;
#if defined(KERF_X86_FILTER)
  if (__builtin_cpu_supports("avx512f") != 0 && !hidden_set("avx512")) {
    sets[count++] = &kFilterAvx512;
  }
  if (__builtin_cpu_supports("avx2") != 0 && !hidden_set("avx2")) sets[count++] = &kFilterAvx2;
#endif
  sets[count] = &kFilterScalar;
  return sets;
}

}  // namespace

const FilterKernels* const* filter_kernels() noexcept {
  static const FilterSets kSets = filter_sets_of_this_machine();
  return kSets.data();
}

}  // namespace kerf
