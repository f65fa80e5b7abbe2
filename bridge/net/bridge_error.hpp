// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace kerf::bridge {

/// What ends the program at start: one line "place: value; way out".
struct BridgeError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace kerf::bridge
