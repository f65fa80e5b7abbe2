// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/scene_setting.hpp"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <utility>
#include <variant>
#include <vector>

#include "controller/scene/scene_text.hpp"
#include "shared/text/words.hpp"

namespace kerf {
namespace {

/// A text; but a number that no double holds, as 1e400, is infinite: beyond every range.
TomlValue value_of(const std::string& text) {
  char* stop = nullptr;
  errno = 0;
  const double number = std::strtod(text.c_str(), &stop);
  if (errno != ERANGE || *stop != '\0') return text;
  return number;
}

/// The value; what TOML cannot read is a text. Line 0: it stands in no file.
TomlNode value_node(const SceneSetting& setting) {
  TomlNode node;
  try {
    node = parse_toml("v = " + setting.value).entries.at(0);
  } catch (const TomlError&) {
    node.form = TomlNode::Form::value;
    node.value = value_of(setting.value);
    node.shown =
        one_line(std::holds_alternative<double>(node.value) ? setting.value : written(node.value));
  }
  node.line = node.key_line = 0;
  return node;
}

/// The entry of that key, new where there is none.
TomlNode& entry_of(TomlNode& table, std::string_view key) {
  const auto found = std::ranges::find(table.entries, key, &TomlNode::key);
  if (found != table.entries.end()) return *found;
  TomlNode& entry = table.entries.emplace_back();
  entry.key = key;
  return entry;
}

}  // namespace

SceneSetting parse_setting(std::string_view text, SceneKeys keys) {
  const std::size_t equals = text.find('=');
  const std::string place = "--set " + one_line(text);
  if (equals == text.npos || equals == 0 || equals + 1 == text.size() || one_line(text) != text) {
    refuse(place, ": not KEY=VALUE; write such as force.stiffness_n_per_mm=0.3");
  }
  const std::string_view key = text.substr(0, equals);
  if (std::ranges::find(keys, key, &SceneKey::name) == keys.end()) {
    std::vector<std::string_view> known;
    for (const SceneKey& row : keys) known.push_back(row.name);
    const std::string_view near = nearest(key, known);
    refuse("--set " + std::string(key),
           " is no key of a scene; " +
               (near.empty() ? "" : "did you mean " + std::string(near) + "? ") +
               "docs/scene-keys.md has all");
  }
  return {std::string(key), std::string(text.substr(equals + 1))};
}

void put_settings(std::span<const SceneSetting> settings, TomlNode& root) {
  for (const SceneSetting& setting : settings) {
    const std::size_t dot = setting.key.find('.'), last = setting.key.rfind('.');
    const std::string table = setting.key.substr(0, dot), key = setting.key.substr(last + 1);
    const auto put = [&](TomlNode& into) {
      // `[[volume]]` has a table below it, `pose`.
      TomlNode& below =
          last == dot ? into : entry_of(into, setting.key.substr(dot + 1, last - dot - 1));
      TomlNode node = value_node(setting);
      node.key = key;
      entry_of(below, key) = std::move(node);
    };
    if (most_of(table) == 0) {
      put(entry_of(root, table));
      continue;
    }
    TomlNode* list = root.find(table) == nullptr ? nullptr : &entry_of(root, table);
    if (list == nullptr || list->entries.empty()) {
      refuse("--set " + setting.key, ": the scene has no [[" + table + "]]; write one in its file");
    }
    for (TomlNode& entry : list->entries) put(entry);
  }
}

}  // namespace kerf
