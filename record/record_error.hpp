// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace kerf {

/// A recording that cannot be written or read. One line: "place: value; way out".
class RecordError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace kerf
