// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <variant>

#include "controller/input/load_error.hpp"
#include "controller/law/registry/law_registry.hpp"
#include "controller/scene/scene_keys.hpp"

namespace kerf {
namespace {

constexpr std::string_view kHead =
    "# Scene keys\n\n"
    "Every key of a scene file (TOML), from the table in `controller/scene/scene_keys.cpp`. "
    "Examples\n"
    "are in `scenes/`. `./kerf controller --scene-keys` prints this list.\n";

/// The allowed values, by the type of the slot.
struct AllowedText {
  const Allowed& allowed;

  std::string operator()(const bool*) const { return "true, false"; }
  std::string operator()(const int*) const { return "whole, " + range(); }
  std::string operator()(const double*) const {
    return range() + (allowed.words.empty() ? "" : ", or " + words());
  }
  std::string operator()(const Denoise*) const { return "whole, " + range() + ", or " + words(); }
  std::string operator()(const LawChoice*) const { return "{ name = \"..\", .. }"; }
  template <class Text>
  std::string operator()(const Text*) const {
    return allowed.words.empty() ? "text" : words();
  }
  template <std::size_t N>
  std::string operator()(const std::array<double, N>*) const {
    return std::to_string(N) + " numbers, " + range();
  }
  std::string operator()(const VoxelGrid*) const { return "3 whole numbers, " + range(); }
  template <class T>
  std::string operator()(const std::optional<T>*) const {
    return (*this)(static_cast<const T*>(nullptr));
  }

 private:
  [[nodiscard]] std::string range() const { return range_text(allowed.range.lo, allowed.range.hi); }
  [[nodiscard]] std::string words() const {
    std::string list;
    for (const std::string_view word : allowed.words) {
      list += (list.empty() ? "\"" : ", \"") + std::string(word) + '"';
    }
    return list;
  }
};

std::string condition_text(const SceneCondition& condition) {
  if (condition.key.empty()) return "";
  return std::string(condition.is ? "; only with " : "; not with ") + std::string(condition.key) +
         " = \"" + std::string(condition.word) + '"';
}

std::string row_of(const SceneKey& key) {
  SceneParts parts;
  std::string by_default(key.options.default_text);
  if (by_default.empty()) by_default = written(value_of(key, parts));
  if (!key.options.required_as.empty()) by_default = "required";
  return "| `" + std::string(name_in_table(key)) + "` | " + std::string(key.unit) + " | " +
         std::visit(AllowedText{key.allowed}, key.at(parts)) + " | " + by_default + " | " +
         std::string(key.meaning) + condition_text(key.only_with) + " |\n";
}

/// The settings of the current parts.
std::string lines_of(std::string_view table, SceneParts& parts, SceneKeys keys) {
  std::string lines;
  for (const SceneKey& key : keys_of(table, keys)) {
    const std::string value = is_used(key, parts) ? written(value_of(key, parts)) : "";
    if (!value.empty()) lines += std::string(key.name) + "=" + value + "\n";
  }
  return lines;
}

/// The laws of one kind that a key of the table can name, each with its settings.
std::string laws_of(std::string_view key, LawKind kind) {
  std::string text;
  for (const LawRow* law : known_laws(kind)) {
    text += "\n`" + std::string(key) + " = { name = \"" + std::string(law->name) +
            "\" }`: " + std::string(law->meaning) + ".\n";
    if (law->settings.empty()) continue;
    text += "\n| setting | unit | value | default | meaning |\n|---|---|---|---|---|\n";
    for (const LawSetting& setting : law->settings) {
      text += "| `" + std::string(setting.name) + "` | " + std::string(setting.unit) + " | " +
              range_text(setting.lo, setting.hi) + " | " + number_text(setting.by_default) + " | " +
              std::string(setting.meaning) + " |\n";
    }
  }
  return text;
}

}  // namespace

std::string scene_keys_page(SceneKeys keys) {
  std::string page(kHead);
  for (const std::string_view table : names_below("", keys)) {
    const std::size_t limit = most_of(table);
    const std::string name(table);
    page += "\n## " +
            (limit == 0 ? "[" + name + "]" : "[[" + name + "]], at most " + std::to_string(limit)) +
            "\n\n";
    const auto about = std::ranges::find(scene_tables(), table, &SceneTableRow::name);
    if (about != scene_tables().end()) page += std::string(about->meaning) + "\n\n";
    page += "| key | unit | value | default | meaning |\n|---|---|---|---|---|\n";
    for (const SceneKey& key : keys_of(table, keys)) page += row_of(key);
    for (const SceneKey& key : keys_of(table, keys)) {
      SceneParts parts;
      const SceneSlot slot = key.at(parts);
      if (const auto* law = std::get_if<LawChoice*>(&slot))
        page += laws_of(name_in_table(key), (*law)->kind);
    }
  }
  return page;
}

std::string settings_text(const SceneSpec& scene, SceneKeys keys) {
  SceneParts parts{.scene = scene, .volume = {}, .tool = {}, .material = {}};
  std::string text;
  const auto add_each = [&](std::string_view table, const auto& list, auto& part) {
    for (const auto& entry : list) {
      part = entry;
      text += lines_of(table, parts, keys);
    }
  };
  for (const std::string_view table : names_below("", keys)) {
    if (table == "volume") add_each(table, scene.volumes, parts.volume);
    if (table == "tool") add_each(table, scene.tools, parts.tool);
    if (table == "material") add_each(table, scene.materials, parts.material);
    if (most_of(table) == 0) text += lines_of(table, parts, keys);
    if (!scene.second || (table != "device" && table != "hand")) continue;
    SceneParts second{.scene = scene, .volume = {}, .tool = {}, .material = {}};
    second.scene.device = scene.second->device;
    second.scene.hand_script = scene.second->hand_script;
    text += lines_of(table, second, keys);
  }
  return text;
}

}  // namespace kerf
