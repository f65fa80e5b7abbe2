// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

namespace kerf::fuzz {

/// The promise of every reader of a user's file: a result, or an `Error` of one line. Anything else
/// escapes or aborts, which is a finding.
template <class Error, class Parse>
void must_read_or_explain(const std::uint8_t* data, std::size_t size, Parse parse) {
  std::string_view text;
  if (size > 0) text = {reinterpret_cast<const char*>(data), size};
  try {
    static_cast<void>(parse(text));
  } catch (const Error& error) {
    const std::string_view line = error.what();
    if (line.empty() || line.size() > 1000 || line.find('\n') != line.npos) std::abort();
  }
}

}  // namespace kerf::fuzz
