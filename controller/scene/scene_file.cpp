// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/scene_file.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <ios>
#include <iterator>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "controller/scene/burs.hpp"
#include "controller/scene/materials.hpp"
#include "controller/scene/scene_rules.hpp"
#include "controller/scene/scene_table.hpp"
#include "controller/scene/scene_text.hpp"
#include "shared/posix/failure.hpp"
#include "shared/posix/unreachable.hpp"

namespace kerf {
namespace {

/// A scene file after parsing, and its tables beside the rows of their keys.
struct SceneTables {
  const TomlNode& root;
  const std::string file;
  SceneKeys keys;

  /// `[name]`; an empty table where the file has none.
  [[nodiscard]] SceneTable once(std::string_view name) const {
    static const TomlNode nothing;
    const TomlNode* node = root.find(name);
    return {std::string(name), file, node == nullptr ? nothing : *node, keys};
  }
  /// All `[[name]]` in the order of the file.
  [[nodiscard]] std::vector<SceneTable> all(std::string_view name) const {
    std::vector<SceneTable> tables;
    if (const TomlNode* list = root.find(name)) {
      for (const TomlNode& node : list->entries) {
        tables.emplace_back(std::string(name), file, node, keys);
      }
    }
    return tables;
  }
};

/// Names tell volumes and tools apart in pictures and reports.
template <class Spec>
void add_named(const SceneTable& table, Spec spec, std::vector<Spec>& list,
               const char* way_out = "write another name = \"..\"") {
  if (std::ranges::find(list, spec.name, &Spec::name) != list.end()) {
    refuse(table.place(), " is the second named \"" + spec.name + "\"; " + way_out);
  }
  list.push_back(std::move(spec));
}

void read_lists(const SceneTables& tables, SceneParts& parts) {
  Scene& scene = parts.scene;
  for (const SceneTable& table : tables.all("volume")) {
    parts.volume = {};
    table.read(parts);
    table.read_conditional(parts);
    finish_volume(table, parts.volume);
    add_named(table, parts.volume, scene.volumes);
  }
  for (const SceneTable& table : tables.all("tool")) {
    parts.tool = {};
    table.read(parts);
    table.read_conditional(parts);
    finish_tool(table, parts.tool);
    add_named(table, parts.tool, scene.tools);
  }
  std::vector<Material> given;
  for (const SceneTable& table : tables.all("material")) {
    table.read(parts);
    add_named(table, parts.material, given, "write one [[material]] with the keys of both");
    // Now that the name is known: what is known of it, and above that what the table says.
    Material& material = material_named(table, parts.material.name, scene.materials);
    parts.material = material;
    table.read(parts);
    table.read_conditional(parts);
    material = parts.material;
    material.in_scene = true;
  }
}

void refuse_empty(const Scene& scene) {
  if (scene.volumes.empty()) {
    refuse(scene.path, ": no [[volume]]; write one with file = \"phantom\" or a path");
  }
  if (std::ranges::none_of(scene.volumes, &VolumeSpec::solid)) {
    refuse(scene.path, ": no [[volume]] is solid; set solid = true for what is to be felt");
  }
  if (scene.tools.empty()) {
    refuse(scene.path, ": no [[tool]]; write one with shape = \"ball\" and size_vox = 16");
  }
}

Scene read_scene(const TomlNode& root, const std::filesystem::path& path, SceneKeys keys) {
  check_names(root, path.string(), keys);
  const SceneTables tables{root, path.string(), keys};
  SceneParts parts;
  Scene& scene = parts.scene;
  scene.path = path.string();
  scene.materials = default_materials();
  read_lists(tables, parts);
  refuse_empty(scene);

  std::vector<SceneTable> once;
  for (const std::string_view name : names_below("", keys)) {
    if (most_of(name) == 0) once.push_back(tables.once(name));
  }
  for (const SceneTable& table : once) table.read(parts);
  choose_cut(tables.once("cut"), scene);
  for (const SceneTable& table : once) table.read_conditional(parts);
  finish_device(tables.once("device"), scene);
  refuse_idle_coupling(tables.once("force"), scene.force);
  finish_limits(tables.once("limits"), scene.limits);
  refuse_uncut(scene);
  refuse_unfelt(scene);
  if (!scene.hand_script.empty()) {
    scene.hand_script = (path.parent_path() / scene.hand_script).string();
    scene.hand_place = tables.once("hand").place("script");
  }
  return std::move(parts.scene);
}

}  // namespace

Scene parse_scene(std::string_view text, const std::filesystem::path& path, SceneKeys keys,
                  std::span<const SceneSetting> settings) {
  try {
    TomlNode root = parse_toml(text);
    put_settings(settings, root);
    spell_out_burs(root, path.string());
    return read_scene(root, path, keys);
  } catch (const TomlError& error) {
    refuse(path.string() + ":" + std::to_string(error.line) + ":" + std::to_string(error.column),
           std::string(": ") + error.what());
  }
}

Scene parse_scene_file(const std::filesystem::path& path, std::span<const SceneSetting> settings) {
  constexpr std::uintmax_t kLargestFile = std::uintmax_t{1} << 20;
  std::error_code fault;
  if (const std::string why = why_unreachable(path); !why.empty()) refuse(path.string(), why);
  if (!exists(symlink_status(path, fault))) {
    refuse(path.string(), ": no such scene file; name one, for example scenes/phantom.toml");
  }
  if (!std::filesystem::is_regular_file(path, fault)) {
    refuse(path.string(), ": is no regular file; name a scene file");
  }
  const std::uintmax_t size = std::filesystem::file_size(path, fault);
  if (fault || size > kLargestFile) {
    refuse(path.string(), ": not a scene file, it is larger than 1 MiB; name a scene file");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    const int error = errno;
    refuse(path.string(), ": " + std::generic_category().message(error) + "; " +
                              way_out_of(error, "check its permissions"));
  }
  std::string text;
  try {
    text.assign(std::istreambuf_iterator<char>(file), {});
  } catch (const std::ios_base::failure&) {
    refuse(path.string(), ": cannot be read; copy it again, or check its disk");
  }
  return parse_scene(text, path, scene_keys(), settings);
}

void check_hand_script(const SceneSettings& scene) {
  std::error_code fault;
  if (scene.hand_script.empty() || std::filesystem::is_regular_file(scene.hand_script, fault)) {
    return;
  }
  if (const std::string why = why_unreachable(scene.hand_script); !why.empty()) {
    refuse(scene.hand_place, why);
  }
  refuse(scene.hand_place,
         " is no file in the scene's folder; copy the script there, or name one by its whole path");
}

}  // namespace kerf
