// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

namespace kerf {

/// Bad input or set-up of the emulator, as one line: `place: value; way out`. The only exception of
/// `hil`; the program prints it after its name and ends with exit code 2.
///
/// A line it stays, whatever it quotes: control characters of a user's file (and of the TOML
/// parser's own words) become blanks, and what is too long to read is cut.
class HilError : public std::runtime_error {
 public:
  explicit HilError(std::string text) : std::runtime_error(one_line(std::move(text))) {}

 private:
  static std::string one_line(std::string text) {
    constexpr std::size_t kLongestLine = 400;
    if (text.size() > kLongestLine) text.resize(kLongestLine);
    const auto is_control = [](char c) {
      return static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
    };
    std::replace_if(text.begin(), text.end(), is_control, ' ');
    return text;
  }
};

}  // namespace kerf
