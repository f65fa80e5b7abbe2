// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>

namespace kerf {

/// `text` on one line, whatever it quotes of a user's file: control characters become blanks, and
/// what is too long to read is cut.
[[nodiscard]] inline std::string one_line(std::string_view text) {
  constexpr std::size_t kLongestLine = 400;
  std::string line(text.substr(0, kLongestLine));
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
  std::replace_if(line.begin(), line.end(), is_control, ' ');
  return line;
}

/// `a, b, c`.
template <class Names>
[[nodiscard]] std::string listed(const Names& names) {
  std::string list;
  for (const auto& name : names) {
    if (!list.empty()) list += ", ";
    list += name;
  }
  return list;
}

}  // namespace kerf
