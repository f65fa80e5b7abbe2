// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string_view>

namespace kerf {

/// The names that the environment variable KERF_HIDE_SETS may have, with commas or blanks between
/// them; `scalar` is run all the same.
inline constexpr std::array<std::string_view, 4> kHideableSets{"avx512", "avx2", "neon", "scalar"};

/// The first name in KERF_HIDE_SETS for which `wanted(name)` is true; else empty.
template <class Wanted>
[[nodiscard]] std::string_view find_in_hidden_sets(const Wanted& wanted) noexcept {
  const char* const text = std::getenv("KERF_HIDE_SETS");  // NOLINT(concurrency-mt-unsafe): not set
  std::string_view rest = text != nullptr ? text : "";
  while (!rest.empty()) {
    const std::string_view name = rest.substr(0, rest.find_first_of(", "));
    rest.remove_prefix(std::min(name.size() + 1, rest.size()));
    if (!name.empty() && wanted(name)) return name;
  }
  return {};
}

/// Whether KERF_HIDE_SETS has this instruction set. The program then behaves as on a processor
/// without it, so that one machine can test what others run (docs/determinism.md). Load time.
[[nodiscard]] inline bool hidden_set(std::string_view set) noexcept {
  return !find_in_hidden_sets([&](std::string_view name) { return name == set; }).empty();
}

/// The first name in KERF_HIDE_SETS that no instruction set has, and that would hide nothing; else
/// empty. Programs refuse to start with one.
[[nodiscard]] inline std::string_view unknown_hidden_set() noexcept {
  return find_in_hidden_sets([](std::string_view name) {
    return std::find(kHideableSets.begin(), kHideableSets.end(), name) == kHideableSets.end();
  });
}

}  // namespace kerf
