// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdlib>

namespace kerf::test {

/// How many random cases of a test: KERF_CASES in the environment multiplies them. Sanitizers and
/// emulated processors make each some twenty times slower, and get fewer.
[[nodiscard]] inline int cases(int usual) {
#ifdef KERF_FEWER_CASES
  usual = std::max(1, usual / 40);
#endif
  const char* factor = std::getenv("KERF_CASES");
  return usual * (factor == nullptr ? 1 : std::max(1, std::atoi(factor)));
}

}  // namespace kerf::test
