// SPDX-License-Identifier: Apache-2.0
#include "hil/script/script_table.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "hil/hil_error.hpp"
#include "shared/posix/input_file.hpp"
#include "shared/text/text.hpp"

namespace kerf {

ScriptTable::ScriptTable(const TomlNode& node, std::string location, std::string name)
    : node_(node), location_(std::move(location)), name_(std::move(name)) {}

void ScriptTable::fail(const TomlNode& node, std::string_view key, const std::string& why) const {
  const std::string dot = name_.empty() || key.empty() ? "" : ".";
  throw HilError(location_ + ":" + std::to_string(node.line) + ": " + name_ + dot +
                 std::string(key) + why);
}

void ScriptTable::fail(const std::string& why) const {
  fail(node_, "", why);
}

void ScriptTable::allow_only(std::span<const std::string_view> keys) const {
  for (const TomlNode& entry : node_.entries) {
    if (std::ranges::find(keys, entry.key) != keys.end()) continue;
    fail(entry, entry.key, ": unknown key; known here: " + listed(keys));
  }
}

double ScriptTable::checked(const TomlNode& node, std::string_view key, ScriptRange range) const {
  const auto value = node.number();
  if (!value) fail(node, key, ": not a number; write one");
  const auto [low, high, above_low] = range;
  if (*value <= high && (above_low ? *value > low : *value >= low)) return *value;  // no nan is
  fail(node, key,
       " = " + node.shown + " is out of range; use " + (above_low ? "more than " : "") +
           number_text(low) + (above_low ? ", at most " : " to ") + number_text(high));
}

double ScriptTable::number(std::string_view key, double otherwise, ScriptRange range) const {
  const TomlNode* node = node_.find(key);
  return node == nullptr ? otherwise : checked(*node, key, range);
}

int ScriptTable::whole(std::string_view key, int otherwise, ScriptRange range) const {
  const double value = number(key, otherwise, range);
  if (value != std::floor(value)) {
    fail(": " + std::string(key) + " is not whole; use a whole number");
  }
  return static_cast<int>(value);
}

void ScriptTable::read_list(std::string_view key, std::span<double> into, ScriptRange range) const {
  const TomlNode& list = *node_.find(key);
  const std::string wanted = "; write " + std::to_string(into.size()) + " numbers";
  if (list.form != TomlNode::Form::array) fail(list, key, ": not a list" + wanted);
  if (list.entries.size() != into.size()) {
    fail(list, key, ": a list of " + std::to_string(list.entries.size()) + wanted);
  }
  for (std::size_t i = 0; i < into.size(); ++i) into[i] = checked(list.entries[i], key, range);
}

std::string ScriptTable::word(std::string_view key, const std::string& otherwise,
                              std::span<const std::string_view> words) const {
  const TomlNode* node = node_.find(key);
  if (node == nullptr) return otherwise;
  const auto* value = std::get_if<std::string>(&node->value);
  if (value != nullptr && std::ranges::find(words, *value) != words.end()) return *value;
  fail(*node, key, ": unknown value; use one of " + listed(words));
}

bool ScriptTable::flag(std::string_view key) const {
  const TomlNode* node = node_.find(key);
  if (node == nullptr) return false;
  if (const bool* value = std::get_if<bool>(&node->value)) return *value;
  fail(*node, key, ": not a truth value; use true or false");
}

const TomlNode* ScriptTable::table(std::string_view key) const {
  const TomlNode* node = node_.find(key);
  if (node != nullptr && node->form != TomlNode::Form::table) {
    fail(*node, key, ": not a table; write [" + std::string(key) + "]");
  }
  return node;
}

std::span<const TomlNode> ScriptTable::tables(const std::string& key, std::size_t most) const {
  const TomlNode* list = node_.find(key);
  const auto is_table = [](const TomlNode& entry) { return entry.form == TomlNode::Form::table; };
  if (list == nullptr || list->form != TomlNode::Form::array || list->entries.empty() ||
      !std::ranges::all_of(list->entries, is_table)) {
    throw HilError(location_ + ": no " + key + "s; add at least one [[" + key + "]]");
  }
  if (list->entries.size() > most) {
    throw HilError(location_ + ": " + std::to_string(list->entries.size()) + " " + key +
                   "s; use at most " + std::to_string(most));
  }
  return list->entries;
}

TomlNode parse_script(std::string_view text, const std::string& location) {
  try {
    return parse_toml(text);
  } catch (const TomlError& error) {
    throw HilError(location + ":" + std::to_string(error.line) + ": " + one_line(error.what()));
  }
}

std::string read_script(const std::filesystem::path& file, const std::string& example) {
  try {
    return read_input_file(file, example);
  } catch (const InputFileError& error) {
    throw HilError(error.what());
  }
}

}  // namespace kerf
