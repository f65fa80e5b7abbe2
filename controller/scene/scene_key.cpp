// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/scene_key.hpp"

#include <algorithm>
#include <iterator>
#include <string>
#include <vector>

#include "controller/law/registry/law_registry.hpp"

namespace kerf {
namespace {

/// One line for each type that a slot can have.
struct Get {
  std::span<const std::string_view> words;

  TomlValue operator()(const bool* from) const { return *from; }
  TomlValue operator()(const int* from) const { return std::int64_t{*from}; }
  TomlValue operator()(const double* from) const { return *from; }
  TomlValue operator()(const std::string* from) const {
    return from->empty() ? TomlValue{} : TomlValue{*from};
  }
  template <class Choice>
  TomlValue operator()(const Choice* from) const {
    return std::string(words[static_cast<std::size_t>(*from)]);
  }
  TomlValue operator()(const Denoise* from) const {
    if (*from > Denoise::off) return static_cast<std::int64_t>(*from);
    return std::string(words[*from == Denoise::off ? 1 : 0]);
  }
  TomlValue operator()(const VoxelGrid* from) const {
    return std::vector<double>{double(from->nx), double(from->ny), double(from->nz)};
  }
  /// All settings of the law, those that the scene leaves out too.
  TomlValue operator()(const LawChoice* from) const {
    if (from->name.empty()) return {};
    const LawRow& row = find_law(from->kind, from->name);
    const std::vector<double> values = law_values(row, *from);
    NamedNumbers law{from->name, {}};
    for (std::size_t i = 0; i < values.size(); ++i) {
      law.numbers.emplace_back(row.settings[i].name, values[i]);
    }
    return law;
  }
  template <std::size_t N>
  TomlValue operator()(const std::array<double, N>* from) const {
    return std::vector<double>(from->begin(), from->end());
  }
  template <class T>
  TomlValue operator()(const std::optional<T>* from) const {
    if (*from) return (*this)(&**from);
    return words.empty() ? TomlValue{} : TomlValue{std::string(words.front())};
  }
};

}  // namespace

std::size_t most_of(std::string_view table) {
  const auto row = std::ranges::find(scene_tables(), table, &SceneTableRow::name);
  return row == scene_tables().end() ? 0 : row->limit;
}

std::vector<std::string_view> names_below(std::string_view prefix, SceneKeys keys) {
  std::vector<std::string_view> names;
  for (const SceneKey& key : keys) {
    if (!key.name.starts_with(prefix)) continue;
    std::string_view name = key.name.substr(prefix.size());
    name = name.substr(0, name.find('.'));
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  return names;
}

std::vector<SceneKey> keys_of(std::string_view table, SceneKeys keys) {
  std::vector<SceneKey> rows;
  std::ranges::copy_if(keys, std::back_inserter(rows), [&](const SceneKey& key) {
    return key.name.substr(0, key.name.find('.')) == table;
  });
  return rows;
}

std::string_view name_in_table(const SceneKey& key) {
  return key.name.substr(key.name.find('.') + 1);
}

bool is_used(const SceneKey& key, SceneParts& parts) {
  const auto& [other, word, is, refusal] = key.only_with;
  if (other.empty()) return true;
  const auto row = std::ranges::find(scene_keys(), other, &SceneKey::name);
  return (value_of(*row, parts) == TomlValue{std::string(word)}) == is;
}

TomlValue value_of(const SceneKey& key, SceneParts& parts) {
  return std::visit(Get{key.allowed.words}, key.at(parts));
}

}  // namespace kerf
