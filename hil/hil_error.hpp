// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace kerf {

/// Bad input or set-up of the emulator, as one line: `place: value; way out`. The only exception of
/// `hil`; the program prints it after its name and ends with exit code 2.
class HilError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace kerf
