// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>

namespace kerf {

/// Whether the environment variable KERF_HIDE_SETS, names with commas or blanks between them, has
/// this instruction set. The program then behaves as on a processor without it, so that one machine
/// can test what others run (docs/determinism.md). Load time.
[[nodiscard]] inline bool hidden_set(const char* name) noexcept {
  const auto divides = [](char c) { return c == ',' || c == ' '; };
  const char* at = std::getenv("KERF_HIDE_SETS");  // NOLINT(concurrency-mt-unsafe): never set
  while (at != nullptr && *at != '\0') {
    const char* rest = name;
    for (; *rest != '\0' && *at == *rest; ++at) ++rest;
    if (*rest == '\0' && (*at == '\0' || divides(*at))) return true;
    while (*at != '\0' && !divides(*at++)) {
    }
  }
  return false;
}

}  // namespace kerf
