// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdio>

#include "controller/kernel/kernel_set.hpp"

namespace kerf::test {

inline constexpr const KernelSet* kBuiltSets[] = {
#if defined(KERF_X86_KERNELS)
    &kAvx512Set, &kAvx2Set,
#elif defined(KERF_NEON_KERNELS)
    &kNeonSet,
#endif
    &kScalarSet};

/// `kernel_sets()`, for a test that runs all of them. Prints once which of this build's are left
/// out, for the summary of ./kerf test.
[[nodiscard]] inline const KernelSet* const* sets_to_run() {
  [[maybe_unused]] static const bool kTold = [] {
    const KernelSet* const* end = kernel_sets();
    while (*end != nullptr) ++end;
    for (const KernelSet* set : kBuiltSets) {
      if (std::find(kernel_sets(), end, set) != end) continue;
      std::printf("skipped: kernels of %s: not on this processor, or hidden by KERF_HIDE_SETS\n",
                  set->name);
    }
    return true;
  }();
  return kernel_sets();
}

}  // namespace kerf::test
