// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/scene_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <variant>

#include "controller/law/registry/law_registry.hpp"
#include "controller/scene/scene_text.hpp"
#include "shared/text/words.hpp"

namespace kerf {
namespace {

/// Takes the value that stands at a key into its slot, if it is of that type and allowed.
struct Take {
  const SceneKey& key;
  const TomlNode& node;
  const std::string place;  ///< `file:line: table.key = value`
  const std::string& file;

  void operator()(bool* into) const {
    const bool* flag = std::get_if<bool>(&node.value);
    if (flag == nullptr) refuse(place, " is not a switch; write true or false");
    *into = *flag;
  }
  void operator()(int* into) const {
    const bool whole = std::holds_alternative<std::int64_t>(node.value);
    if (!whole) refuse(place, " is not a whole number; write one without point or exponent");
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
  /// The name of a law, and those of its settings that are given.
  void operator()(LawChoice* into) const {
    const TomlNode* name = node.form == TomlNode::Form::table ? node.find("name") : nullptr;
    const std::string* text = name == nullptr ? nullptr : std::get_if<std::string>(&name->value);
    if (text == nullptr) {
      refuse(place, " does not say which; write { name = \"..\" } and what it sets");
    }
    const auto place_below = [&](const TomlNode& entry) {
      return place_of(entry, std::string(key.name) + "." + one_line(entry.key), file);
    };
    const LawRow* row = nullptr;
    try {
      row = &find_law(into->kind, *text);
    } catch (const LawError& error) {
      refuse(place_below(*name), error.what());
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
      refuse(place, " is not a list of " + std::to_string(N) + " numbers; write " +
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
      refuse(place, " counts " + std::string(key.unit) + "; write whole numbers");
    }
    const auto side = [&](std::size_t axis) { return static_cast<std::int32_t>(sides[axis]); };
    *into = {side(0), side(1), side(2)};
  }
  template <class T>
  void operator()(std::optional<T>* into) const {
    if (!is_word()) (*this)(&into->emplace());
  }

 private:
  /// One of the key's words, where any are given.
  [[nodiscard]] std::string text() const {
    const std::string* text = std::get_if<std::string>(&node.value);
    if (text == nullptr) refuse(place, " is not text; put it in quotes");
    if (!is_usable_text(*text)) {
      refuse(place, " is not a usable text; write 1 to " + std::to_string(kLongestText) +
                        " printable characters");
    }
    const auto words = key.allowed.words;
    if (words.empty() || std::ranges::find(words, *text) != words.end()) return *text;
    const auto [lo, hi] = key.allowed.range;
    const bool or_number = lo < hi;
    refuse(place,
           unknown_word(*text, words, "\"") + (or_number ? ", or " + range_text(lo, hi) : ""));
  }
  /// Whether a word stands for a number.
  [[nodiscard]] bool is_word() const {
    if (key.allowed.words.empty() || !std::holds_alternative<std::string>(node.value)) return false;
    return !text().empty();
  }
  /// The number of `entry`: the value, or a part of it.
  [[nodiscard]] double number(const TomlNode& entry) const {
    const std::optional<double> number = entry.number();
    if (!number) refuse(place, " is not a number; write one without quotes or unit");
    const auto [lo, hi] = key.allowed.range;
    if (*number >= lo && *number <= hi) return *number + 0.0;  // no nan is; -0 becomes 0
    std::string words;
    for (const std::string_view word : key.allowed.words)
      words += ", or \"" + std::string(word) + '"';
    refuse(place, " is out of range; use " + range_text(lo, hi) + words);
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
      refuse(place(name), refusal_of(key.only_with));
    }
  }
}

void SceneTable::read(const SceneKey& key, SceneParts& parts) const {
  const std::string_view name = name_in_table(key);
  const std::string form(key.options.required_as);
  if (has(name)) {
    std::visit(Take{key, *node_->find(name), place(name), file_}, key.at(parts));
  } else if (!form.empty()) {
    refuse(place(), " has no " + std::string(name) + "; write " + form);
  }
}

bool SceneTable::is_text(std::string_view key) const {
  return has(key) && std::holds_alternative<std::string>(node_->find(key)->value);
}

std::string SceneTable::where(std::string_view key) const {
  const std::size_t line = node_->find(key)->line;
  return file_ + (line == 0 ? ": --set" : ":" + std::to_string(line));
}

std::string SceneTable::place(std::string_view key) const {
  return place_of(*node_->find(key), name_ + "." + std::string(key), file_);
}

std::string SceneTable::place() const {
  return file_ + ":" + std::to_string(node_->line) + ": " + name_;
}

std::string place_of(const TomlNode& node, std::string_view name, const std::string& file) {
  // What stands in no line was set from outside.
  const std::string at = node.line == 0 ? " --set " : std::to_string(node.line) + ": ";
  return file + ":" + at + std::string(name) + " = " + node.shown;
}

}  // namespace kerf
