// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/toml_tree.hpp"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "controller/scene/scene_text.hpp"
#include "shared/text/toml.hpp"

namespace kerf {
namespace {

constexpr std::size_t kLongestShown = 60;  // characters of a value that a message repeats

TomlNode node_of(const toml::node& from) {
  TomlNode to;
  to.line = from.source().begin.line;
  if (const toml::table* table = from.as_table()) {
    for (const auto& [key, value] : *table) {
      TomlNode& entry = to.entries.emplace_back(node_of(value));
      entry.key = key.str();
      entry.key_line = key.source().begin.line;
      entry.key_column = key.source().begin.column;
    }
    // toml++ sorts by the alphabet.
    std::ranges::stable_sort(to.entries, {}, [](const TomlNode& entry) {
      return std::pair(entry.key_line, entry.key_column);
    });
    to.shown = "{..}";
  } else if (const toml::array* array = from.as_array()) {
    to.form = TomlNode::Form::array;
    for (const toml::node& entry : *array) {
      to.entries.push_back(node_of(entry));
      if (to.shown.size() <= kLongestShown) {
        to.shown += (to.shown.empty() ? "[" : ", ") + to.entries.back().shown;
      }
    }
    to.shown += to.shown.empty() ? "[]" : "]";
  } else {
    to.form = TomlNode::Form::value;
    if (const auto flag = from.as_boolean()) to.value = flag->get();
    if (const auto whole = from.as_integer()) to.value = whole->get();
    if (const auto number = from.as_floating_point()) to.value = number->get();
    if (const auto text = from.as_string()) to.value = text->get();
    to.shown = one_line(written(to.value));
    if (to.shown.empty()) to.shown = "a date or time";
  }
  if (to.shown.size() > kLongestShown) to.shown = to.shown.substr(0, kLongestShown) + "...";
  return to;
}

}  // namespace

const TomlNode* TomlNode::find(std::string_view path) const {
  const std::size_t dot = path.find('.');
  const auto found = std::ranges::find(entries, path.substr(0, dot), &TomlNode::key);
  if (found == entries.end()) return nullptr;
  return dot == path.npos ? &*found : found->find(path.substr(dot + 1));
}

TomlNode parse_toml_tree(std::string_view text, const std::string& file) {
  const toml::parse_result parsed = toml::parse(text, file);
  if (parsed) return node_of(parsed.table());
  const toml::parse_error& error = parsed.error();
  const auto at = error.source().begin;
  refuse(file + ":" + std::to_string(at.line) + ":" + std::to_string(at.column),
         ": " + toml_problem(error));
}

std::string written(const TomlValue& value) {
  const auto text = [](const auto& held) -> std::string {
    using T = std::remove_cvref_t<decltype(held)>;
    if constexpr (std::is_same_v<T, std::monostate>) return "";
    if constexpr (std::is_same_v<T, bool>) return held ? "true" : "false";
    if constexpr (std::is_same_v<T, std::int64_t>) return std::to_string(held);
    if constexpr (std::is_same_v<T, double>) return number_text(held);
    if constexpr (std::is_same_v<T, std::string>) return '"' + held + '"';
    if constexpr (std::is_same_v<T, std::vector<double>>) {
      std::string list;
      for (const double number : held) list += (list.empty() ? "" : ", ") + number_text(number);
      return "[" + list + "]";
    }
  };
  return std::visit(text, value);
}

}  // namespace kerf
