// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string_view>

#include "shared/text/text.hpp"

namespace kerf {

/// Bad input, or a vendor's library or device that cannot be used. One line: `place: value;
/// remedy`; line breaks in texts of the library are removed. The only exception type of `arm`; the
/// program prints it after its name and ends with exit code 2.
class ArmError : public std::runtime_error {
 public:
  explicit ArmError(std::string_view text) : std::runtime_error(one_line(text)) {}
};

}  // namespace kerf
