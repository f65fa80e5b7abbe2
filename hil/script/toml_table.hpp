// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "hil/hil_error.hpp"
#include "shared/text/toml.hpp"

namespace kerf {

/// A range and how to say it.
struct TomlRange {
  double low;
  double high;
  bool above_low = false;  ///< `low` itself is refused
};

/// One table of a file with what is needed to complain about it: every getter throws `HilError`
/// with file, line, key, value and way out.
class TomlTable {
 public:
  TomlTable(const toml::table& table, std::string place, std::string name)
      : table_(table), place_(std::move(place)), name_(std::move(name)) {}

  [[noreturn]] void fail(const toml::node& node, const std::string& key,
                         const std::string& why) const {
    const std::string dot = name_.empty() || key.empty() ? "" : ".";
    throw HilError(place_ + ":" + std::to_string(node.source().begin.line) + ": " + name_ + dot +
                   key + why);
  }
  [[noreturn]] void fail(const std::string& why) const { fail(table_, "", why); }

  void allow_only(std::initializer_list<std::string_view> keys) const {
    for (const auto& [key, node] : table_) {
      if (std::find(keys.begin(), keys.end(), key.str()) != keys.end()) continue;
      std::string known;
      for (const auto allowed : keys) known += (known.empty() ? "" : ", ") + std::string(allowed);
      fail(node, std::string(key.str()), ": unknown key; known here: " + known);
    }
  }

  [[nodiscard]] bool has(std::string_view key) const { return table_.contains(key); }

  [[nodiscard]] double number(std::string_view key, double otherwise, TomlRange range) const {
    const toml::node* node = table_.get(key);
    return node == nullptr ? otherwise : checked(*node, std::string(key), range);
  }

  template <std::size_t N>
  [[nodiscard]] std::array<double, N> numbers(std::string_view key, std::array<double, N> otherwise,
                                              TomlRange range) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return otherwise;
    const toml::array* list = node->as_array();
    if (list == nullptr || list->size() != N) {
      fail(*node, std::string(key), ": not a list; write " + std::to_string(N) + " numbers");
    }
    std::array<double, N> values{};
    for (std::size_t i = 0; i < N; ++i) values[i] = checked((*list)[i], std::string(key), range);
    return values;
  }

  [[nodiscard]] std::string word(std::string_view key, const std::string& otherwise,
                                 std::span<const std::string_view> words) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return otherwise;
    const auto value = node->value<std::string>();
    if (value && std::find(words.begin(), words.end(), *value) != words.end()) return *value;
    std::string known;
    for (const auto allowed : words) known += (known.empty() ? "" : ", ") + std::string(allowed);
    fail(*node, std::string(key), ": unknown value; use one of " + known);
  }

  [[nodiscard]] bool flag(std::string_view key) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return false;
    if (!node->is_boolean())
      fail(*node, std::string(key), ": not a truth value; use true or false");
    return node->as_boolean()->get();
  }

 private:
  [[nodiscard]] double checked(const toml::node& node, const std::string& key,
                               TomlRange range) const;

  const toml::table& table_;
  std::string place_;
  std::string name_;
};

/// Text of `place` as TOML; throws `HilError` with place, line and what is wrong.
[[nodiscard]] toml::table parse_toml(std::string_view text, const std::string& place);

/// The tables of `[[key]]`, at least one and at most `most`; throws `HilError` otherwise.
[[nodiscard]] const toml::array& tables_of(const toml::table& file, std::string_view key,
                                           std::size_t most, const std::string& place);

/// The whole of a regular file of at most 1 MiB; `example` is named where there is none.
[[nodiscard]] std::string read_small_file(const std::filesystem::path& file,
                                          const std::string& example);

}  // namespace kerf
