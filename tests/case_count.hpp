// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdlib>
#include <initializer_list>
#include <vector>

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

/// A list of rates, shapes or kinds of numbers; its first alone where each is that slow.
template <class T>
[[nodiscard]] std::vector<T> kinds(std::initializer_list<T> all) {
#ifdef KERF_FEWER_CASES
  return {*all.begin()};
#else
  return all;
#endif
}

}  // namespace kerf::test
