// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <string>

namespace kerf {

/// The text of a printf pattern, cut off after 511 characters.
template <class... Values>
[[nodiscard]] std::string format(const char* pattern, Values... values) {
  char text[512];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

}  // namespace kerf
