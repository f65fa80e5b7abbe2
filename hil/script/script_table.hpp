// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>

#include "shared/text/toml.hpp"

namespace kerf {

inline constexpr double kMaxScriptSeconds = 3600;

/// A range of numbers.
struct ScriptRange {
  double low;
  double high;
  bool above_low = false;  ///< `low` itself is refused
};

/// One table of a script and its name in errors: every getter throws `HilError` with file, line,
/// key, value and way out. Refers to the parsed file, which must outlive it.
class ScriptTable {
 public:
  /// `name` is empty for the whole file.
  ScriptTable(const TomlNode& node, std::string location, std::string name);

  [[noreturn]] void fail(const std::string& why) const;
  void allow_only(std::span<const std::string_view> keys) const;
  void allow_only(std::initializer_list<std::string_view> keys) const {
    allow_only(std::span(keys.begin(), keys.size()));
  }
  [[nodiscard]] bool has(std::string_view key) const { return node_.find(key) != nullptr; }
  [[nodiscard]] double number(std::string_view key, double otherwise, ScriptRange range) const;
  [[nodiscard]] int whole(std::string_view key, int otherwise, ScriptRange range) const;
  template <std::size_t N>
  [[nodiscard]] std::array<double, N> numbers(std::string_view key, std::array<double, N> otherwise,
                                              ScriptRange range) const {
    if (has(key)) read_list(key, otherwise, range);
    return otherwise;
  }
  [[nodiscard]] std::string word(std::string_view key, const std::string& otherwise,
                                 std::span<const std::string_view> words) const;
  [[nodiscard]] bool flag(std::string_view key) const;
  /// The table `[key]`; null if it is absent.
  [[nodiscard]] const TomlNode* table(std::string_view key) const;
  /// The tables of `[[key]]`, at least one and at most `most`.
  [[nodiscard]] std::span<const TomlNode> tables(const std::string& key, std::size_t most) const;

 private:
  [[noreturn]] void fail(const TomlNode& node, std::string_view key, const std::string& why) const;
  [[nodiscard]] double checked(const TomlNode& node, std::string_view key, ScriptRange range) const;
  void read_list(std::string_view key, std::span<double> into, ScriptRange range) const;

  const TomlNode& node_;
  std::string location_;
  std::string name_;
};

/// Text of `location` as TOML; throws `HilError` with location, line and reason.
[[nodiscard]] TomlNode parse_script(std::string_view text, const std::string& location);

/// The whole of a regular file of at most 1 MiB; the error names `example` if there is none.
[[nodiscard]] std::string read_script(const std::filesystem::path& file,
                                      const std::string& example);

}  // namespace kerf
