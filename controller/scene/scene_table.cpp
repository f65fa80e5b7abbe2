// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/scene_table.hpp"

#include <algorithm>
#include <utility>

#include "controller/scene/scene_text.hpp"

namespace kerf {
namespace {

constexpr std::size_t kLongestValue = 60;  // characters of a value that a message repeats
constexpr std::size_t kLongestText = 256;  // bytes of a name or a path

/// The value as one would write it in the file.
std::string written(const toml::node& node) {
  if (const auto text = node.as_string()) return '"' + text->get() + '"';
  if (const auto number = node.as_floating_point()) return number_text(number->get());
  if (const auto number = node.as_integer()) return std::to_string(number->get());
  if (const auto flag = node.as_boolean()) return flag->get() ? "true" : "false";
  if (node.is_table()) return "{..}";
  const toml::array* array = node.as_array();
  if (array == nullptr) return "a date or time";
  std::string list;
  for (const toml::node& entry : *array) {
    list += (list.empty() ? "" : ", ") + written(entry);
    if (list.size() > kLongestValue) break;
  }
  return "[" + list + "]";
}

std::string shown(const toml::node& node) {
  std::string line = one_line(written(node));
  if (line.size() > kLongestValue) line = line.substr(0, kLongestValue) + "...";
  return line;
}

std::string listed(std::span<const std::string_view> names) {
  std::string list;
  for (const std::string_view name : names) {
    if (!list.empty()) list += ", ";
    list += name;
  }
  return list;
}

/// The unit that the end of a key tells, as ` (in mm)`.
std::string unit_hint(std::string_view key) {
  constexpr std::pair<std::string_view, std::string_view> kUnits[] = {
      {"_mm_per_s", "mm/s"}, {"_n_per_mm2", "N/mm^2"},
      {"_n_per_ms", "N/ms"}, {"_per_s", "1/s"},
      {"_mm", "mm"},         {"_n", "N"},
      {"_hz", "Hz"},         {"_rad", "rad"},
      {"_vox", "voxels"}};
  for (const auto& [ending, unit] : kUnits) {
    if (key.ends_with(ending)) return " (in " + std::string(unit) + ")";
  }
  return "";
}

std::string unknown_key_advice(std::string_view key, std::string_view prefix,
                               std::span<const std::string_view> known) {
  const std::string_view near = nearest(key, known);
  if (near.empty()) return "; known here: " + listed(known);
  return "; did you mean " + std::string(prefix) + std::string(near) + unit_hint(near) + "?";
}

}  // namespace

SceneTable::SceneTable(const toml::table& table, std::string name, std::string file,
                       std::span<const std::string_view> known_keys)
    : table_(&table), name_(std::move(name)), file_(std::move(file)) {
  const toml::key* first_unknown = nullptr;  // in the order of the file, not of the alphabet
  for (const auto& [key, value] : table) {
    if (std::find(known_keys.begin(), known_keys.end(), key.str()) != known_keys.end()) continue;
    if (first_unknown == nullptr || key.source().begin < first_unknown->source().begin) {
      first_unknown = &key;
    }
  }
  if (first_unknown == nullptr) return;
  const auto at = first_unknown->source().begin;
  const std::string prefix = name_.empty() ? "" : name_ + ".";
  refuse(file_ + ":" + std::to_string(at.line) + ":" + std::to_string(at.column),
         ": " + prefix + std::string(first_unknown->str()) + " is not a known key" +
             unknown_key_advice(first_unknown->str(), prefix, known_keys));
}

const toml::node* SceneTable::find(std::string_view key) const {
  return table_->get(key);
}

bool SceneTable::has(std::string_view key) const {
  return find(key) != nullptr;
}

std::string SceneTable::where(std::string_view key) const {
  return file_ + ":" + std::to_string(find(key)->source().begin.line);
}

std::string SceneTable::place(std::string_view key) const {
  const std::string prefix = name_.empty() ? "" : name_ + ".";
  return where(key) + ": " + prefix + std::string(key) + " = " + shown(*find(key));
}

std::string SceneTable::place() const {
  return file_ + ":" + std::to_string(table_->source().begin.line) + ": " + name_;
}

double SceneTable::in_range(std::string_view key, const toml::node& node, Range range) const {
  const std::optional<double> value = node.is_number() ? node.value<double>() : std::nullopt;
  if (!value) refuse(place(key), " is not a number; write one without quotes or unit");
  if (!(*value >= range.lo && *value <= range.hi)) {  // also refuses nan
    refuse(place(key),
           " is out of range; use " + number_text(range.lo) + " to " + number_text(range.hi));
  }
  return *value;
}

std::optional<double> SceneTable::number(std::string_view key, Range range) const {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  return in_range(key, *node, range);
}

std::optional<std::int32_t> SceneTable::whole(std::string_view key, Range range) const {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_integer()) refuse(place(key), " is not a whole number; write one");
  return static_cast<std::int32_t>(in_range(key, *node, range));
}

std::optional<bool> SceneTable::flag(std::string_view key) const {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_boolean()) refuse(place(key), " is not a switch; write true or false");
  return node->value<bool>();
}

std::optional<std::string> SceneTable::text(std::string_view key) const {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_string()) refuse(place(key), " is not text; put it in quotes");
  std::string text = *node->value<std::string>();
  if (text.empty() || text.size() > kLongestText || one_line(text) != text) {
    refuse(place(key), " is not a usable text; write 1 to " + std::to_string(kLongestText) +
                           " printable characters");
  }
  return text;
}

std::optional<std::size_t> SceneTable::choice(std::string_view key,
                                              std::span<const std::string_view> choices) const {
  const std::optional<std::string> word = text(key);
  if (!word) return std::nullopt;
  const auto found = std::find(choices.begin(), choices.end(), *word);
  if (found == choices.end()) {
    const std::string_view near = nearest(*word, choices);
    const std::string guess = near.empty() ? "" : "did you mean \"" + std::string(near) + "\"? ";
    refuse(place(key), " is unknown; " + guess + "known: " + listed(choices));
  }
  return static_cast<std::size_t>(found - choices.begin());
}

void SceneTable::read_numbers(std::string_view key, Range range, std::span<double> out) const {
  const toml::array* array = find(key)->as_array();
  if (array == nullptr || array->size() != out.size()) {
    refuse(place(key), " is not a list of " + std::to_string(out.size()) + " numbers; write [" +
                           (out.size() == 2   ? "a, b"
                            : out.size() == 3 ? "x, y, z"
                                              : "x, y, z, w") +
                           "]");
  }
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = in_range(key, *array->get(i), range);
}

bool SceneTable::is_array(std::string_view key) const {
  const toml::node* node = find(key);
  return node != nullptr && node->is_array();
}

bool SceneTable::is_text(std::string_view key) const {
  const toml::node* node = find(key);
  return node != nullptr && node->is_string();
}

std::optional<SceneTable> SceneTable::table(std::string_view key,
                                            std::span<const std::string_view> known) const {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_table()) {
    const std::string form =
        name_.empty() ? "[" + std::string(key) + "]" : std::string(key) + " = { .. }";
    refuse(place(key), " is not a table; write " + form);
  }
  const std::string name = name_.empty() ? std::string(key) : name_ + "." + std::string(key);
  return SceneTable(*node->as_table(), name, file_, known);
}

std::vector<SceneTable> SceneTable::tables(std::string_view key,
                                           std::span<const std::string_view> known,
                                           std::size_t limit) const {
  std::vector<SceneTable> list;
  const toml::node* node = find(key);
  if (node == nullptr) return list;
  const toml::array* array = node->as_array();
  if (array == nullptr || array->empty() || !array->is_homogeneous(toml::node_type::table)) {
    refuse(place(key), " is not a list of tables; write [[" + std::string(key) + "]]");
  }
  if (array->size() > limit) {
    refuse(place(key), " has " + std::to_string(array->size()) + " entries; use at most " +
                           std::to_string(limit));
  }
  for (const toml::node& entry : *array) {
    list.emplace_back(*entry.as_table(), std::string(key), file_, known);
  }
  return list;
}

}  // namespace kerf
