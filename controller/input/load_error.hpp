// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <charconv>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>

#include "shared/posix/stop_signals.hpp"
#include "shared/text/text.hpp"

// The one exception of load time, and the texts of its messages. Inline: the core-only build has no
// library of it.

namespace kerf {

/// A fault of a scene, a volume or a tool, as one line: `location: value; remedy`.
///
/// The only exception of the loading code. `main` adds the program's name, prints the line and
/// returns 2.
class LoadError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Six digits or another number, for computed values that are not written down again.
[[nodiscard]] inline std::string short_text(double value, int digits = 6) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                 std::chars_format::general, digits);
  return {buffer.data(), end.ptr};
}

/// A value that is refused because of `limit`: six digits, or as many as make the two differ.
[[nodiscard]] inline std::string text_beside(double value, double limit) {
  int digits = 6;
  while (digits < std::numeric_limits<double>::max_digits10 && value != limit &&
         short_text(value, digits) == short_text(limit, digits)) {
    ++digits;
  }
  return short_text(value, digits);
}

/// `0.0001 to 100000`: without exponents.
[[nodiscard]] inline std::string range_text(double lo, double hi) {
  const auto plain = [](double value) -> std::string {
    std::array<char, 400> buffer{};  // digits of the largest double, and more
    const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                   std::chars_format::fixed);
    return {buffer.data(), end.ptr};
  };
  return plain(lo) + " to " + plain(hi);
}

inline constexpr std::size_t kLongestText = 256;  // bytes of a name or a path

/// True for 1 to kLongestText bytes that print on one line.
[[nodiscard]] inline bool is_usable_text(std::string_view text) {
  return !text.empty() && text.size() <= kLongestText && one_line(text) == text;
}

/// Throws LoadError `location: what`, on one line.
[[noreturn]] inline void refuse(std::string_view location, std::string_view what) {
  throw LoadError(one_line(std::string(location) + std::string(what)));
}

/// For long work of load time: throws LoadError if a signal asked the program to end. `location`:
/// the subject of the work, mostly a file.
inline void end_if_asked(const std::string& location) {
  if (!stop_requested()) return;
  throw LoadError(location + ": reading it was stopped by a signal; start again");
}

}  // namespace kerf
