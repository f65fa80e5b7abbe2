// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <string_view>

namespace kerf {

/// The names that the environment variable KERF_HIDE_SETS may have, with commas or blanks between
/// them; `scalar` is run all the same.
inline constexpr std::array<std::string_view, 4> kHideableSets{"avx512", "avx2", "neon", "scalar"};

/// The first name in KERF_HIDE_SETS for which `wanted(name)` is true; else empty. No function of
/// the C library but getenv: the kernels ask.
template <class Wanted>
[[nodiscard]] std::string_view find_in_hidden_sets(const Wanted& wanted) noexcept {
  const char* at = std::getenv("KERF_HIDE_SETS");  // NOLINT(concurrency-mt-unsafe): never set
  while (at != nullptr && *at != '\0') {
    std::size_t size = 0;
    while (at[size] != '\0' && at[size] != ',' && at[size] != ' ') ++size;
    const std::string_view name(at, size);
    if (size > 0 && wanted(name)) return name;
    at += size;
    if (*at != '\0') ++at;
  }
  return {};
}

/// Whether KERF_HIDE_SETS has this instruction set. The program then behaves as on a processor
/// without it, so that one machine can test what others run (docs/determinism.md). Load time.
[[nodiscard]] inline bool hidden_set(const char* set) noexcept {
  const auto is_it = [set](std::string_view name) {
    std::size_t same = 0;
    while (same < name.size() && set[same] == name[same]) ++same;
    return same == name.size() && set[same] == '\0';
  };
  return !find_in_hidden_sets(is_it).empty();
}

/// The first name in KERF_HIDE_SETS that no instruction set has, and that would hide nothing; else
/// empty. Programs refuse to start with one.
[[nodiscard]] inline std::string_view unknown_hidden_set() noexcept {
  return find_in_hidden_sets([](std::string_view name) {
    return std::find(kHideableSets.begin(), kHideableSets.end(), name) == kHideableSets.end();
  });
}

}  // namespace kerf
