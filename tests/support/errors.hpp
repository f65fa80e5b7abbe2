// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <string>

namespace kerf::test {

/// The message of the `Error` that `call` throws; empty if it throws none. An exception of another
/// type passes through.
template <class Error = std::exception, class Call>
[[nodiscard]] std::string error_of(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

/// Is `part` in `text`?
[[nodiscard]] inline bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace kerf::test
