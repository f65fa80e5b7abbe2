// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string_view>

#include "shared/text/text.hpp"

namespace kerf {

/// Bad input or set-up of the emulator or of the lab, as one line: `location: value; way out`. The
/// only exception of `hil`; the program prints it after its name and ends with exit code 2. A line
/// it stays, whatever it quotes of a user's file or of the TOML parser's own words.
class HilError : public std::runtime_error {
 public:
  explicit HilError(std::string_view text) : std::runtime_error(one_line(text)) {}
};

}  // namespace kerf
