// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

// Numbers, hex, printf patterns, quoting, spelling suggestions, and the bytes of a file.

namespace kerf {

/// `text` on one line and safe for a terminal: control characters, which a path may contain, are
/// written as in C, `\n` or `\x1b`. Other UTF-8 stays.
[[nodiscard]] inline std::string escaped(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string shown;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const bool follows = i > 0 && text[i - 1] == '\xc2';
    const bool is_control = byte < 0x20 || byte == 0x7f || (follows && byte >= 0x80 && byte < 0xa0);
    if (byte == '\n') {
      shown += "\\n";
    } else if (is_control) {
      shown.append("\\x").append({kDigits[byte >> 4], kDigits[byte & 0xf]});
    } else {
      shown += text[i];
    }
  }
  return shown;
}

/// `escaped`, at most 400 bytes of it, so the same again gives the same: for quotations from a file
/// of the user. No escape is cut.
[[nodiscard]] inline std::string one_line(std::string_view text) {
  constexpr std::size_t kLongestLine = 400;
  text = text.substr(0, kLongestLine);
  std::string shown = escaped(text);
  while (shown.size() > kLongestLine) {
    text.remove_suffix(1);
    shown = escaped(text);
  }
  return shown;
}

/// Levenshtein distance of two words.
[[nodiscard]] inline std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t exchanged = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({exchanged, diagonal + 1, row[j] + 1});
    }
  }
  return row.back();
}

/// `a, b, c`.
template <class Names>
[[nodiscard]] std::string listed(const Names& names) {
  std::string list;
  for (const auto& name : names) {
    if (!list.empty()) list += ", ";
    list += name;
  }
  return list;
}

/// The known name that `word` was probably meant to be: the same quantity in another unit
/// (`radius_cm`, `radius` -> `radius_mm`), else the nearest in spelling; empty if none is near.
[[nodiscard]] inline std::string_view nearest(std::string_view word,
                                              std::span<const std::string_view> known) {
  const auto quantity = [](std::string_view key) { return key.substr(0, key.find('_')); };
  const bool is_one = std::ranges::any_of(
      known, [&](std::string_view name) { return quantity(name) == quantity(word); });
  std::string_view best;
  // Half of the letters must be right, else the guess would only mislead.
  std::size_t best_distance = is_one ? std::string_view::npos : word.size() / 2 + 1;
  for (const std::string_view name : known) {
    if (is_one && quantity(name) != quantity(word)) continue;
    const std::size_t distance =
        std::min(edit_distance(word, name), edit_distance(word, quantity(name)));
    if (distance < best_distance) {
      best = name;
      best_distance = distance;
    }
  }
  return best;
}

/// ` is unknown; did you mean b? known: a, b, c`, each word in `quote`.
[[nodiscard]] inline std::string unknown_word(std::string_view word,
                                              std::span<const std::string_view> known,
                                              std::string_view quote = "") {
  std::string text = " is unknown; ";
  if (const std::string_view near = nearest(word, known); !near.empty()) {
    text.append("did you mean ").append(quote).append(near).append(quote).append("? ");
  }
  return text + "known: " + listed(known);
}

/// The whole of `text` as a finite number; none otherwise.
[[nodiscard]] inline std::optional<double> number_in(std::string_view text) {
  double value = 0;
#ifdef __cpp_lib_to_chars
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_whole = error == std::errc{} && end == text.data() + text.size();
#else  // libc++ 16, of WebAssembly, which has no locale but C's
  const std::string whole(text);
  char* end = nullptr;
  value = std::strtod(whole.c_str(), &end);
  const bool is_whole = !text.empty() && text.front() != '+' && text.front() > ' ' &&
                        text.find_first_of("xX") == text.npos &&
                        end == whole.c_str() + whole.size();
#endif
  return is_whole && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

/// Shortest text that reads back as the same number.
[[nodiscard]] inline std::string number_text(double value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), end.ptr};
}

/// `value`, above 0, rounded down to so many digits: a limit that is printed as safe is safe.
[[nodiscard]] inline std::string text_below(double value, int digits) {
  const double step = std::pow(10, std::floor(std::log10(value)) + 1 - digits);
  constexpr double kRounding = 1e-9;  // of a value that is a whole number of steps
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.*g", digits,
                std::floor(value / step + kRounding) * step);
  return buffer.data();
}

/// The text of a printf pattern, cut off after 511 characters.
template <class... Values>
[[nodiscard]] std::string format(const char* pattern, Values... values) {
  char text[512];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

/// 16 hex digits, lower case, as hashes and identities are printed.
[[nodiscard]] inline std::string hex64(std::uint64_t value) {
  std::string text(16, '0');
  for (std::size_t i = text.size(); i-- > 0; value >>= 4) text[i] = "0123456789abcdef"[value & 15];
  return text;
}

}  // namespace kerf
