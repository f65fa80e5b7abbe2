// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "controller/scene/scene_keys.hpp"

namespace kerf::test {

/// The text of a scene as single settings, one on each line: what the generated tests change.
class SceneLines {
 public:
  SceneLines() { set("volume.file", "\"phantom\"").set("tool.shape", "\"cylinder\""); }

  SceneLines& set(std::string_view name, std::string value) {
    values_[std::string(name)] = std::move(value);
    return *this;
  }
  SceneLines& drop(std::string_view name) {
    values_.erase(std::string(name));
    return *this;
  }
  /// Each table of the rows once, its settings below its header.
  [[nodiscard]] std::string text(SceneKeys keys = scene_keys()) const {
    std::string text;
    for (const std::string_view table : names_below("", keys)) {
      std::string lines;
      for (const auto& [name, value] : values_) {
        if (name.rfind(std::string(table) + ".", 0) != 0) continue;
        lines += name.substr(table.size() + 1) + " = " + value + "\n";
      }
      const std::string header(table);
      if (!lines.empty()) {
        text += (most_of(table) > 0 ? "[[" + header + "]]\n" : "[" + header + "]\n") + lines;
      }
    }
    return text;
  }
  /// The line that `set` made.
  [[nodiscard]] long line_of(std::string_view name, SceneKeys keys = scene_keys()) const {
    const std::size_t dot = name.find('.');
    const std::string all = "\n" + text(keys);
    const std::string table(name.substr(0, dot));
    const std::size_t header = all.find((most_of(table) > 0 ? "\n[[" : "\n[") + table + "]");
    const std::size_t at = all.find("\n" + std::string(name.substr(dot + 1)) + " = ", header);
    return std::count(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(at) + 1, '\n');
  }

 private:
  std::map<std::string, std::string> values_;
};

/// A scene in which `key` counts (or just does not) by the choice that it needs, and in which
/// nothing contradicts it.
inline SceneLines scene_for(const SceneKey& key, bool counts = true) {
  SceneLines lines;
  const SceneCondition& needs = key.only_with;
  if (needs.is == counts && !needs.key.empty()) {
    lines.set(needs.key, '"' + std::string(needs.word) + '"');
  } else if (needs.key == "volume.file") {
    lines.set(needs.key, "\"ct.nrrd\"");
  } else if (!needs.key.empty() && needs.key != "tool.shape") {
    const auto row = std::ranges::find(scene_keys(), needs.key, &SceneKey::name);
    const auto words = row->allowed.words;
    lines.set(needs.key,
              '"' + std::string(words.front() == needs.word ? words[1] : words[0]) + '"');
  }
  const bool mesh = needs.key == "tool.shape" && needs.is == counts && needs.word == kMeshShape;
  if (mesh || (needs.key == "tool.shape" && !needs.is && !counts)) {
    lines.set("tool.shape", "\"stl\"").set("tool.file", "\"bur.stl\"");
  } else if (key.name == "tool.length_mm") {
    lines.set("tool.radius_mm", "1");
  } else if (key.name != "tool.radius_mm" || !counts) {
    lines.set("tool.size_vox", "16");
  }
  if (key.name.starts_with("tool.shaft_") || key.name.starts_with("tool.handpiece_")) {
    lines.set("tool.shaft_radius_mm", "0.0001").set("tool.shaft_length_mm", "1");
    lines.set("tool.handpiece_radius_mm", "1000");
  }
  if (key.name.starts_with("material.")) lines.set("material.name", "\"wax\"");
  return lines;
}

}  // namespace kerf::test
