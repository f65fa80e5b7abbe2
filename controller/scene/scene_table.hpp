// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shared/text/toml.hpp"

namespace kerf {

/// Both ends are allowed values.
struct Range {
  double lo, hi;
};

/// One table of a scene file, read strictly: every key must be known, of the right type and in
/// range. Each fault throws SceneError with one line `file:line: table.key = value is ..; way out`;
/// a key that should not be there is shown with line and column, and with the key it resembles.
///
/// Refers to the parsed file, which must outlive it. Load time only.
class SceneTable {
 public:
  SceneTable(const toml::table& table, std::string name, std::string file,
             std::span<const std::string_view> known_keys);

  [[nodiscard]] bool has(std::string_view key) const;
  /// `file:line` of the key.
  [[nodiscard]] std::string where(std::string_view key) const;
  /// `file:line: table.key = value`, the beginning of every complaint about a value.
  [[nodiscard]] std::string place(std::string_view key) const;
  /// `file:line: table`, for what is missing.
  [[nodiscard]] std::string place() const;

  [[nodiscard]] std::optional<double> number(std::string_view key, Range range) const;
  [[nodiscard]] std::optional<std::int32_t> whole(std::string_view key, Range range) const;
  [[nodiscard]] std::optional<bool> flag(std::string_view key) const;
  /// Text of 1..256 bytes without control characters.
  [[nodiscard]] std::optional<std::string> text(std::string_view key) const;
  /// Index into `choices` of the text at `key`.
  [[nodiscard]] std::optional<std::size_t> choice(std::string_view key,
                                                  std::span<const std::string_view> choices) const;
  template <std::size_t N>
  [[nodiscard]] std::optional<std::array<double, N>> numbers(std::string_view key,
                                                             Range range) const {
    if (!has(key)) return std::nullopt;
    std::array<double, N> values{};
    read_numbers(key, range, values);
    return values;
  }
  [[nodiscard]] bool is_array(std::string_view key) const;
  [[nodiscard]] bool is_text(std::string_view key) const;
  [[nodiscard]] std::optional<SceneTable> table(std::string_view key,
                                                std::span<const std::string_view> known) const;
  /// All `[[key]]` in the order of the file; at most `limit`.
  [[nodiscard]] std::vector<SceneTable> tables(std::string_view key,
                                               std::span<const std::string_view> known,
                                               std::size_t limit) const;

 private:
  [[nodiscard]] const toml::node* find(std::string_view key) const;
  [[nodiscard]] double in_range(std::string_view key, const toml::node& node, Range range) const;
  void read_numbers(std::string_view key, Range range, std::span<double> out) const;

  const toml::table* table_;
  std::string name_;
  std::string file_;
};

}  // namespace kerf
