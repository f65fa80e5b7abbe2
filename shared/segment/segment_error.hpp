// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <system_error>

namespace kerf {

/// A segment that cannot be made, reached or trusted. One line: "place: value; way out".
class SegmentError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// No controller of that name answers (yet): worth trying again, unlike every other SegmentError.
class SegmentAbsent : public SegmentError {
 public:
  using SegmentError::SegmentError;
};

/// The text of an `errno`; unlike strerror, for any thread.
[[nodiscard]] inline std::string system_message(int error) {
  return std::generic_category().message(error);
}

}  // namespace kerf
