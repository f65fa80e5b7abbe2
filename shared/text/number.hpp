// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

namespace kerf {

/// The whole of `text` as a finite number; none otherwise.
[[nodiscard]] inline std::optional<double> number_in(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_number =
      error == std::errc{} && end == text.data() + text.size() && std::isfinite(value);
  return is_number ? std::optional(value) : std::nullopt;
}

/// Shortest text that reads back as the same number.
[[nodiscard]] inline std::string number_text(double value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), end.ptr};
}

/// `value` above 0 in so many digits, and never more than it: what is told to be safe is.
[[nodiscard]] inline std::string text_below(double value, int digits) {
  const double step = std::pow(10, std::floor(std::log10(value)) + 1 - digits);
  constexpr double kRounding = 1e-9;  // of a value that is a whole number of steps
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.*g", digits,
                std::floor(value / step + kRounding) * step);
  return buffer.data();
}

}  // namespace kerf
