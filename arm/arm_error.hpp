// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string_view>

#include "shared/text/text.hpp"

namespace kerf {

/// What to do after a crash of the library, to follow its line.
inline constexpr const char* kUnplug =
    "; unplug the device, plug it in again, and see whether the vendor's own program runs";

/// Bad input, or a vendor's library or device that cannot be used. One line: `location: value;
/// remedy`; line breaks in texts of the library are removed. The only exception type of `arm`; the
/// program prints it after its name and ends with exit code 2.
class ArmError : public std::runtime_error {
 public:
  explicit ArmError(std::string_view text) : std::runtime_error(one_line(text)) {}
};

}  // namespace kerf
