// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace kerf {

/// An inline table of numbers behind a name: `{ name = "spring", stiffness = 0.4 }`.
struct NamedNumbers {
  std::string name;
  std::vector<std::pair<std::string, double>> numbers;

  friend bool operator==(const NamedNumbers&, const NamedNumbers&) = default;
};

/// One value as TOML writes it; empty: none, or one that no file of ours uses, such as a date.
using TomlValue = std::variant<std::monostate, bool, std::int64_t, double, std::string,
                               std::vector<double>, NamedNumbers>;

/// A value of a parsed file with its place, and what lies below it.
struct TomlNode {
  enum class Form : std::uint8_t { value, array, table };

  std::string key;  ///< empty for the whole file and for an entry of an array
  std::size_t key_line = 0, key_column = 0;
  std::size_t line = 0;  ///< where the value begins
  std::string shown;     ///< the value for messages: on one line, shortened if it is long
  Form form = Form::table;
  TomlValue value;                ///< of Form::value
  std::vector<TomlNode> entries;  ///< of an array or a table, in the order of the file

  /// The value below a table at `key` or `key.key`; null if there is none.
  [[nodiscard]] const TomlNode* find(std::string_view path) const;
  /// A whole or real number; empty if the value is neither.
  [[nodiscard]] std::optional<double> number() const;
};

/// Text that is not TOML: `problem; remedy`, and the position at which the parser stopped. May hold
/// control characters of the text.
struct TomlError : std::runtime_error {
  TomlError(const std::string& what, std::size_t at_line, std::size_t at_column)
      : std::runtime_error(what), line(at_line), column(at_column) {}
  std::size_t line, column;
};

/// Throws TomlError. Load time.
[[nodiscard]] TomlNode parse_toml(std::string_view text);

/// The value as one would write it in the file; empty for none.
[[nodiscard]] std::string written(const TomlValue& value);

}  // namespace kerf
