// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string_view>
#include <vector>

#include "controller/scene/scene_table.hpp"
#include "controller/scene/scene_text.hpp"
#include "shared/text/words.hpp"

namespace kerf {
namespace {

/// `; did you mean ..?`: the nearest name beside it, and those that are the same elsewhere.
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

/// What stands at the name of a table must be one, or a list of them.
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
