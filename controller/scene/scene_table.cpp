// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/scene_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "controller/input/load_error.hpp"
#include "controller/law/registry/law_registry.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

/// Takes the value of a key into its slot, if it is of that type and allowed.
struct Take {
  const SceneKey& key;
  const TomlNode& node;
  const std::string location;  ///< `file:line: table.key = value`
  const std::string& file;

  void operator()(bool* into) const {
    const bool* flag = std::get_if<bool>(&node.value);
    if (flag == nullptr) refuse(location, " is not a switch; write true or false");
    *into = *flag;
  }
  void operator()(int* into) const {
    const bool whole = std::holds_alternative<std::int64_t>(node.value);
    if (!whole) refuse(location, " is not a whole number; write one without point or exponent");
    *into = static_cast<int>(number(node));
  }
  void operator()(double* into) const {
    if (!is_word()) *into = number(node);
  }
  void operator()(std::string* into) const { *into = text(); }
  template <class Choice>
  void operator()(Choice* into) const {
    const auto words = key.allowed.words;
    *into = static_cast<Choice>(std::ranges::find(words, text()) - words.begin());
  }
  /// The words come before the counts.
  void operator()(Denoise* into) const {
    int passes = 0;
    if (!is_word()) {
      (*this)(&passes);
    } else if (text() == kDenoiseWords.front()) {
      passes = static_cast<int>(Denoise::automatic);
    }
    *into = Denoise{static_cast<std::int8_t>(passes)};
  }
  /// The name of a law, alone or in a table with its given settings; or the word for the default.
  void operator()(LawChoice* into) const {
    const bool is_table = node.form == TomlNode::Form::table;
    const TomlNode* name = is_table ? node.find("name") : &node;
    const std::string* text = name == nullptr ? nullptr : std::get_if<std::string>(&name->value);
    if (text == nullptr) {
      refuse(location, " does not say which; write { name = \"..\" } and what it sets");
    }
    const auto place_below = [&](const TomlNode& entry) {
      return place_of(entry, std::string(key.name) + "." + one_line(entry.key), file);
    };
    const LawRow* row = nullptr;
    try {
      row = is_table ? &find_law(into->kind, *text) : law_by_word(into->kind, *text);
    } catch (const LawError& error) {
      refuse(is_table ? place_below(*name) : location, error.what());
    }
    if (row == nullptr) {
      *into = {into->kind, "", {}};
      return;
    }
    *into = {into->kind, *text, {}};
    for (const TomlNode& entry : node.entries) {
      if (&entry == name) continue;
      const std::optional<double> number = entry.number();
      if (!number) refuse(place_below(entry), " is not a number; write one without quotes or unit");
      const std::string problem = setting_problem(*row, entry.key, *number);
      if (!problem.empty()) refuse(place_below(entry), problem);
      into->settings.emplace_back(entry.key, *number);
    }
  }
  template <std::size_t N>
  void operator()(std::array<double, N>* into) const {
    const bool one = key.options.one_for_all && node.form != TomlNode::Form::array;
    const auto is_number = [](const TomlNode& entry) { return entry.number().has_value(); };
    const bool list = node.form == TomlNode::Form::array && node.entries.size() == N &&
                      std::ranges::all_of(node.entries, is_number);
    if (!one && !list) {
      refuse(location, " is not a list of " + std::to_string(N) + " numbers; write " +
                           (N == 2   ? "[a, b]"
                            : N == 3 ? "[x, y, z]"
                                     : "[x, y, z, w]"));
    }
    for (std::size_t i = 0; i < N; ++i) (*into)[i] = number(one ? node : node.entries[i]);
  }
  void operator()(VoxelGrid* into) const {
    std::array<double, 3> sides{};
    (*this)(&sides);
    if (std::ranges::any_of(sides, [](double side) { return side != std::floor(side); })) {
      refuse(location, " counts " + std::string(key.unit) + "; write whole numbers");
    }
    const auto side = [&](std::size_t axis) { return static_cast<std::int32_t>(sides[axis]); };
    *into = {side(0), side(1), side(2)};
  }
  template <class T>
  void operator()(std::optional<T>* into) const {
    if (!is_word()) (*this)(&into->emplace());
  }

 private:
  /// One of the words of the key, if it has any.
  [[nodiscard]] std::string text() const {
    const std::string* text = std::get_if<std::string>(&node.value);
    if (text == nullptr) refuse(location, " is not text; put it in quotes");
    if (!is_usable_text(*text)) {
      refuse(location, " is not a usable text; write 1 to " + std::to_string(kLongestText) +
                           " printable characters");
    }
    const auto words = key.allowed.words;
    if (words.empty() || std::ranges::find(words, *text) != words.end()) return *text;
    const auto [lo, hi] = key.allowed.range;
    const bool or_number = lo < hi;
    refuse(location,
           unknown_word(*text, words, "\"") + (or_number ? ", or " + range_text(lo, hi) : ""));
  }
  /// Whether the value is a word in place of a number.
  [[nodiscard]] bool is_word() const {
    if (key.allowed.words.empty() || !std::holds_alternative<std::string>(node.value)) return false;
    return !text().empty();
  }
  /// The number of `entry`: the value, or a part of it.
  [[nodiscard]] double number(const TomlNode& entry) const {
    const std::optional<double> number = entry.number();
    if (!number) refuse(location, " is not a number; write one without quotes or unit");
    const auto [lo, hi] = key.allowed.range;
    if (*number >= lo && *number <= hi) return *number + 0.0;  // no nan is; -0 becomes 0
    std::string words;
    for (const std::string_view word : key.allowed.words)
      words += ", or \"" + std::string(word) + '"';
    refuse(location, " is out of range; use " + range_text(lo, hi) + words);
  }
};

/// ` is of the model paper; leave it out, or set model = "paper"`.
std::string refusal_of(const SceneCondition& condition) {
  if (!condition.refusal.empty()) return std::string(condition.refusal);
  const std::string name(condition.key.substr(condition.key.find('.') + 1)), word(condition.word);
  return " is of the " + name + " " + word + "; leave it out, or set " + name + " = \"" + word +
         '"';
}

}  // namespace

SceneTable::SceneTable(std::string name, std::string file, const TomlNode& node, SceneKeys keys)
    : name_(std::move(name)), file_(std::move(file)), node_(&node), keys_(keys_of(name_, keys)) {}

void SceneTable::read(SceneParts& parts) const {
  for (const SceneKey& key : keys_) {
    if (key.only_with.key.empty()) read(key, parts);
  }
}

void SceneTable::read_conditional(SceneParts& parts) const {
  for (const SceneKey& key : keys_) {
    if (key.only_with.key.empty()) continue;
    if (is_used(key, parts)) {
      read(key, parts);
    } else if (const std::string_view name = name_in_table(key); has(name)) {
      refuse(location(name), refusal_of(key.only_with));
    }
  }
}

void SceneTable::read(const SceneKey& key, SceneParts& parts) const {
  const std::string_view name = name_in_table(key);
  const std::string form(key.options.required_as);
  if (has(name)) {
    std::visit(Take{key, *node_->find(name), location(name), file_}, key.at(parts));
  } else if (!form.empty()) {
    refuse(location(), " has no " + std::string(name) + "; write " + form);
  }
}

bool SceneTable::is_text(std::string_view key) const {
  return has(key) && std::holds_alternative<std::string>(node_->find(key)->value);
}

std::string SceneTable::where(std::string_view key) const {
  const std::size_t line = node_->find(key)->line;
  return file_ + (line == 0 ? ": --set" : ":" + std::to_string(line));
}

std::string SceneTable::location(std::string_view key) const {
  return place_of(*node_->find(key), name_ + "." + std::string(key), file_);
}

std::string SceneTable::location() const {
  return file_ + ":" + std::to_string(node_->line) + ": " + name_;
}

std::string place_of(const TomlNode& node, std::string_view name, const std::string& file) {
  // A node without a line comes from the command line.
  const std::string at = node.line == 0 ? " --set " : std::to_string(node.line) + ": ";
  return file + ":" + at + std::string(name) + " = " + node.shown;
}

namespace {

/// `; did you mean ..?`: the nearest name in the same table, and the same name in others.
std::string advice(std::string_view prefix, std::string_view name, SceneKeys keys) {
  const std::vector<std::string_view> beside = names_below(prefix, keys);
  std::vector<std::string> likely;
  if (const std::string_view near = nearest(name, beside); !near.empty()) {
    likely.push_back(std::string(prefix) + std::string(near));
  }
  for (const SceneKey& key : keys) {
    for (std::size_t begin = 0, end = 0; end != key.name.npos; begin = end + 1) {
      end = key.name.find('.', begin);
      if (key.name.substr(begin, end - begin) != name) continue;
      const std::string whole(key.name.substr(0, end));
      if (std::ranges::find(likely, whole) == likely.end()) likely.push_back(whole);
    }
  }
  if (likely.empty()) return "; known here: " + listed(beside);
  std::string line;
  for (const std::string& meant : likely) {
    const auto row = std::ranges::find(keys, meant, &SceneKey::name);
    const bool has_unit = row != keys.end() && !row->unit.empty();
    line += (line.empty() ? "" : " or ") + meant +
            (has_unit ? " (in " + std::string(row->unit) + ")" : "");
  }
  return "; did you mean " + line + "?";
}

/// A node at the name of a table must be a table, or a list of tables.
void check_form(const TomlNode& node, const std::string& name, const std::string& file) {
  const std::size_t limit = most_of(name);
  const auto is_table = [](const TomlNode& n) { return n.form == TomlNode::Form::table; };
  if (limit == 0) {
    const bool inner = name.find('.') != name.npos;
    if (is_table(node)) return;
    refuse(place_of(node, name, file),
           " is not a table; write " + (inner ? node.key + " = { .. }" : "[" + name + "]"));
  }
  if (node.form != TomlNode::Form::array || node.entries.empty() ||
      !std::ranges::all_of(node.entries, is_table)) {
    refuse(place_of(node, name, file), " is not a list of tables; write [[" + name + "]]");
  }
  if (node.entries.size() > limit) {
    refuse(place_of(node, name, file), " has " + std::to_string(node.entries.size()) +
                                           " entries; use at most " + std::to_string(limit));
  }
}

void check_below(const TomlNode& table, const std::string& prefix, const std::string& file,
                 SceneKeys keys) {
  const std::vector<std::string_view> known = names_below(prefix, keys);
  for (const TomlNode& node : table.entries) {
    const std::string name = prefix + node.key;
    if (std::ranges::find(known, node.key) == known.end()) {
      refuse(file + ":" + std::to_string(node.key_line) + ":" + std::to_string(node.key_column),
             ": " + one_line(name) + " is not a known key" + advice(prefix, node.key, keys));
    }
    if (std::ranges::find(keys, name, &SceneKey::name) != keys.end()) continue;
    check_form(node, name, file);
    if (node.form == TomlNode::Form::table) check_below(node, name + ".", file, keys);
    if (node.form == TomlNode::Form::array) {
      for (const TomlNode& entry : node.entries) check_below(entry, name + ".", file, keys);
    }
  }
}

}  // namespace

void check_names(const TomlNode& root, const std::string& file, SceneKeys keys) {
  check_below(root, "", file, keys);
}

}  // namespace kerf
