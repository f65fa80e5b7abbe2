// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/scene_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <ios>
#include <iterator>
#include <optional>
#include <ranges>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

#include "controller/input/load_error.hpp"
#include "controller/law/registry/law_registry.hpp"
#include "controller/scene/scene.hpp"
#include "controller/scene/scene_presets.hpp"
#include "controller/scene/scene_table.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/text/text.hpp"

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

/// The value; a text if TOML cannot read it. Line 0: it is in no file.
TomlNode value_node(const KeyOverride& setting) {
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
  for (TomlNode& entry : node.entries) entry.line = entry.key_line = 0;
  return node;
}

/// Whether `key` is a setting below a law, `force.law.NAME`. The law itself knows which it has.
bool is_law_setting(std::string_view key, SceneKeys keys) {
  const std::size_t last = key.rfind('.');
  const auto law = std::ranges::find(keys, key.substr(0, last), &SceneKey::name);
  if (last == key.npos || last + 1 == key.size() || law == keys.end()) return false;
  SceneParts parts;
  return std::holds_alternative<LawChoice*>(law->at(parts));
}

/// A law as a table: one that is given by its name alone gets the table of that name.
TomlNode& law_table(TomlNode& law) {
  if (!std::holds_alternative<std::string>(law.value)) return law;
  TomlNode name = law;
  name.key = "name";
  law.form = TomlNode::Form::table;
  law.value = {};
  law.entries = {std::move(name)};
  return law;
}

/// The entry of that key; a new one if there is none.
TomlNode& entry_of(TomlNode& table, std::string_view key) {
  const auto found = std::ranges::find(table.entries, key, &TomlNode::key);
  if (found != table.entries.end()) return *found;
  TomlNode& entry = table.entries.emplace_back();
  entry.key = key;
  return entry;
}

/// Keys of the coupling, which have no effect beside a force law.
constexpr std::string_view kCouplingKeys[] = {"stiffness_n_per_mm", "damping_ns_per_mm"};
bool is_of_coupling(std::string_view key) {
  return std::ranges::find(kCouplingKeys, key) != std::end(kCouplingKeys);
}

/// Whether it puts a law in the place of the coupling.
bool replaces_coupling(const KeyOverride& setting) {
  if (setting.key != "force.law") return false;
  const TomlNode node = value_node(setting);
  const auto* word = std::get_if<std::string>(&node.value);
  return word == nullptr || *word != default_law(LawKind::force)->name;
}

}  // namespace

KeyOverride parse_setting(std::string_view text, SceneKeys keys) {
  const std::size_t equals = text.find('=');
  const std::string location = "--set " + one_line(text);
  if (equals == text.npos || equals == 0 || equals + 1 == text.size() || one_line(text) != text) {
    refuse(location, ": not KEY=VALUE; write such as force.stiffness_n_per_mm=0.3");
  }
  const std::string_view key = text.substr(0, equals);
  if (std::ranges::find(keys, key, &SceneKey::name) == keys.end() && !is_law_setting(key, keys)) {
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

void drop_replaced(std::vector<KeyOverride>& earlier, const KeyOverride& later) {
  const bool law = replaces_coupling(later);
  std::erase_if(earlier, [&](const KeyOverride& one) {
    constexpr std::string_view kTable = "force.";
    return one.key == later.key || one.key.starts_with(later.key + ".") ||
           (law && one.key.starts_with(kTable) && is_of_coupling(one.key.substr(kTable.size())));
  });
}

void override_keys(std::span<const KeyOverride> settings, TomlNode& root) {
  const auto last_first = std::views::reverse(settings);
  const auto law = std::ranges::find(last_first, "force.law", &KeyOverride::key);
  if (law != last_first.end() && replaces_coupling(*law)) {
    std::erase_if(entry_of(root, "force").entries,
                  [](const TomlNode& entry) { return is_of_coupling(entry.key); });
  }
  // A law is there before its settings, in whatever order they come.
  std::vector<KeyOverride> in_order(settings.begin(), settings.end());
  std::ranges::stable_partition(in_order, [](const KeyOverride& setting) {
    return !is_law_setting(setting.key, scene_keys());
  });
  for (const KeyOverride& setting : in_order) {
    const std::size_t dot = setting.key.find('.'), last = setting.key.rfind('.');
    const std::string table = setting.key.substr(0, dot), key = setting.key.substr(last + 1);
    const auto put = [&](TomlNode& into) {
      // `[[volume]]` has a table below it, `pose`; a law has its settings.
      TomlNode& below =
          last == dot ? into
                      : law_table(entry_of(into, setting.key.substr(dot + 1, last - dot - 1)));
      TomlNode node = value_node(setting);
      node.key = key;
      if (below.shown.empty()) below.shown = "{ " + key + " = " + node.shown + " }";
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

namespace {

// Rules between keys, which no single row of the table can hold, and values that follow from
// others. `table` has been read into the value beside it. Each throws LoadError.

std::string stem_of(const std::string& file) {
  return std::filesystem::path(file).stem().string();
}

void make_unit(const SceneTable& table, std::array<double, 4>& q) {
  constexpr double kTolerance = 0.01;  // rounded by hand, not forgotten
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (std::abs(length - 1) > kTolerance) {
    refuse(table.location("pose.orientation"),
           " has length " + text_beside(length, 1) + "; write a unit quaternion [x, y, z, w]");
  }
  for (double& component : q) component /= length;
}

/// Of a solid of revolution; a mesh has its own size.
void check_size(const SceneTable& table, const ToolSpec& tool) {
  const ToolSize& size = tool.size;
  if (!table.has("radius_mm") && !table.has("size_vox")) {
    refuse(table.location(), " needs either radius_mm or size_vox; write one of them");
  }
  if (table.has("radius_mm") && table.has("size_vox")) {
    refuse(table.location("radius_mm"), " contradicts size_vox; leave one of the two out");
  }
  if (!size.length_mm) return;
  if (size.size_vox) {
    refuse(table.location("length_mm"), " contradicts size_vox, which is a cube; leave it out");
  }
  if (tool.shape == "ball") {
    refuse(table.location("length_mm"), " contradicts the ball, which is round; leave it out");
  }
  if (tool.shape == "wheel" && *size.length_mm > 2 * size.radius_mm) {
    refuse(table.location("length_mm"),
           " is more than the wheel's diameter; use at most " + number_text(2 * size.radius_mm));
  }
}

/// For any tool; limits by the length of the head are checked once that is known (load_scene.cpp).
void check_shaft(const SceneTable& table, ToolSpec& tool) {
  const ShaftSize& shaft = tool.shaft;
  if (shaft.radius_mm && !shaft.length_mm) {
    refuse(table.location("shaft_radius_mm"),
           " has no length; write shaft_length_mm, from the tool's tip to the shaft's end");
  }
  if (shaft.length_mm && !shaft.radius_mm) {
    refuse(table.location("shaft_length_mm"), " has no radius; write shaft_radius_mm");
  }
  if (shaft.handpiece_radius_mm && !shaft.radius_mm) {
    refuse(table.location("handpiece_radius_mm"),
           " has no shaft to hold; write shaft_radius_mm and shaft_length_mm");
  }
  if (shaft.handpiece_length_mm && !shaft.handpiece_radius_mm) {
    refuse(table.location("handpiece_length_mm"), " has no radius; write handpiece_radius_mm");
  }
  if (shaft.handpiece_radius_mm && *shaft.handpiece_radius_mm < *shaft.radius_mm) {
    refuse(table.location("handpiece_radius_mm"),
           " is narrower than the shaft; use at least " + number_text(*shaft.radius_mm));
  }
  if (shaft.length_mm) tool.shaft_location = table.location("shaft_length_mm");
}

/// The grit's law with the keys of the table in place of its values.
void settle_law(const SceneTable& table, ToolSpec& tool) {
  const BurSettings& own = tool.bur_settings;
  tool.law = grit_law(own.grit);
  const auto settle = [&](const char* key, const std::optional<double>& given, double& value) {
    if (!given) return;
    value = *given;
    tool.law_location = table.location(key);
  };
  if (own.grit != Grit::none) tool.law_location = table.location("grit");
  settle("force_exponent", own.force_exponent, tool.law.force_exponent);
  settle("speed_exponent", own.speed_exponent, tool.law.speed_exponent);
  settle("wear_half_n_s", own.wear_half_n_s, tool.law.wear_half_n_s);
  settle("saturation_n", own.saturation_n, tool.law.saturation_n);
}

void finish_volume(const SceneTable& table, VolumeSpec& volume) {
  volume.where = table.where("file");
  if (!table.has("name")) volume.name = stem_of(volume.file);
  if (volume.window && (*volume.window)[0] >= (*volume.window)[1]) {
    refuse(table.location("window"), " is empty; write [low, high] with low < high");
  }
  if (volume.orientation) make_unit(table, *volume.orientation);
}

void finish_tool(const SceneTable& table, ToolSpec& tool) {
  std::string name;
  if (tool.shape == kMeshShape) {
    tool.where = table.where("file");
    tool.size_location = table.location("file");
    name = stem_of(tool.file);
  } else {
    check_size(table, tool);
    const bool in_voxels = tool.size.size_vox.has_value();
    tool.size_location = table.location(in_voxels ? "size_vox" : "radius_mm");
    name = tool.shape + " " +
           (in_voxels ? std::to_string(*tool.size.size_vox) + " vox"
                      : number_text(tool.size.radius_mm) + " mm");
  }
  check_shaft(table, tool);
  settle_law(table, tool);
  tool.pitch_given = table.has("pitch_mm");
  if (tool.pitch_given) tool.pitch_location = table.location("pitch_mm");
  if (!table.has("name")) tool.name = name;
}

/// The material of that name: one of the list, or a new one at its end with its known properties.
Material& material_named(const SceneTable& table, const std::string& name,
                         std::vector<Material>& materials) {
  if (name == materials.front().name) {
    refuse(table.location("name"), " is air and has no properties; use another name");
  }
  const auto material = std::ranges::find(materials, name, &Material::name);
  return material != materials.end() ? *material : materials.emplace_back(known_material(name));
}

void finish_device(const SceneTable& table, const std::filesystem::path& path, SceneSpec& scene) {
  // Without contact there is no surface to go to.
  scene.offset_given = table.has("offset_mm") || scene.force.model == ForceModel::external;
  if (table.has("first_tool")) scene.device.tool_location = table.location("first_tool");
  std::string& identified = scene.device.identified;
  if (!identified.empty()) identified = (path.parent_path() / identified).string();
  for (const double sign : scene.device.encoder_sign.value_or(std::array{1.0, 1.0, 1.0})) {
    if (std::abs(sign) == 1) continue;
    refuse(
        table.location("encoder_sign"),
        " is not 1 or -1 at each joint; ./kerf controller --probe shows which (docs/devices.md)");
  }
  if (!scene.device.torque_scale) return;
  for (const double scale : *scene.device.torque_scale) {
    if (std::abs(scale) >= kMinTorqueScale) continue;
    refuse(table.location("torque_scale"),
           " is below 0.001 N mm per count; leave the key out to keep the motors off");
  }
}

/// The paper's force has no normal that could cut by force: unless the scene names another model of
/// cutting, it comes with that of the paper. Of what a program's force cuts, kerf knows nothing.
void choose_cut(const SceneTable& table, SceneSpec& scene) {
  scene.cut_in_one_tick = table.is_text("rate_per_s");
  if (scene.force.model == ForceModel::paper && !table.has("model")) {
    scene.cut.model = CutModel::overlap;
  }
  if (scene.force.model != ForceModel::external) return;
  if (table.has("model") && scene.cut.model != CutModel::none) {
    refuse(table.location("model"),
           " cuts by contact, and force.model = \"external\" has none; leave it out");
  }
  scene.cut.model = CutModel::none;
}

/// The overlap models cut every material, forbidden or not.
void refuse_uncut(const SceneSpec& scene) {
  if (scene.cut.model == CutModel::none || scene.cut.model == CutModel::preston) return;
  for (const Material& material : scene.materials) {
    if (!material.forbidden) continue;
    refuse(scene.path, ": material " + material.name +
                           " is forbidden, and this cut.model cuts everything; set model "
                           "= \"preston\", or leave forbidden out");
  }
}

/// Without cutting by force a bur needs no law; with it, there has to be a force that cuts.
void refuse_idle_laws(const SceneSpec& scene) {
  for (const ToolSpec& tool : scene.tools) {
    if (tool.law_location.empty()) continue;
    if (scene.cut.model != CutModel::preston) {
      refuse(tool.law_location,
             " is of cutting by force; set cut.model = \"preston\", or leave it out");
    }
    if (tool.law.saturation_n > 0 && tool.law.saturation_n <= scene.cut.threshold_n) {
      refuse(tool.law_location, " leaves no force that cuts: cut.threshold_n is " +
                                    number_text(scene.cut.threshold_n) +
                                    "; use a lower threshold, or a saturation_n above it");
    }
  }
}

/// The paper's force is computed for heads alone.
void refuse_unfelt(const SceneSpec& scene) {
  if (scene.force.model == ForceModel::proxy) return;
  for (const ToolSpec& tool : scene.tools) {
    if (!tool.shaft.length_mm) continue;
    refuse(tool.shaft_location,
           " has contact only with the proxy; set force.model = \"proxy\", or leave the shaft out");
  }
}

/// A law replaces the coupling, so the keys of the coupling have no effect.
void refuse_idle_coupling(const SceneTable& table, const ForceSettings& force) {
  if (force.law.name.empty()) return;
  for (const std::string_view key : kCouplingKeys) {
    if (table.has(key)) {
      refuse(table.location(key),
             " is of the coupling, and force.law is in its place; leave it out");
    }
  }
}

LimitPlaces limit_places(const SceneTable& table) {
  const auto location = [&](const char* key) { return table.has(key) ? table.location(key) : ""; };
  return {location("force_n"), location("continuous_force_n"), location("slew_n_per_ms")};
}

/// A scene file after parsing, and its tables beside the rows of their keys.
struct SceneTables {
  const TomlNode& root;
  const std::string file;
  SceneKeys keys;

  /// `[name]`; an empty table if the file has none.
  [[nodiscard]] SceneTable once(std::string_view name) const {
    static const TomlNode kNothing;
    const TomlNode* node = root.find(name);
    return {std::string(name), file, node == nullptr ? kNothing : *node, keys};
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
    refuse(table.location(), " is the second named \"" + spec.name + "\"; " + way_out);
  }
  list.push_back(std::move(spec));
}

void read_lists(const SceneTables& tables, SceneParts& parts) {
  SceneSpec& scene = parts.scene;
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
    // Now that the name is known: its preset, and then the keys of the table.
    Material& material = material_named(table, parts.material.name, scene.materials);
    parts.material = material;
    table.read(parts);
    table.read_conditional(parts);
    material = parts.material;
    material.in_scene = true;
  }
}

/// A scene for the force of a program needs no volume and no tool, a servo one of each: a ball out
/// of reach, as in scenes/empty.toml, and a tip to be seen.
void fill_in(SceneSpec& scene) {
  if (scene.force.model != ForceModel::external) return;
  if (scene.volumes.empty() && scene.device.fit) {
    refuse(scene.path,
           ": device.fit fits the scene to its first [[volume]], and there is none; "
           "leave it out");
  }
  if (scene.volumes.empty()) {
    VolumeSpec& volume = scene.volumes.emplace_back();
    volume.where = scene.path;
    volume.name = "none";
    volume.file = kPhantomFile;
    volume.shape = "ball";
    volume.phantom_size = VoxelGrid{8, 8, 8};
    volume.iso = 0.5;
    volume.position_mm = {0, -1000, 0};
  }
  if (scene.tools.empty()) {
    ToolSpec& tool = scene.tools.emplace_back();
    tool.size_location = scene.path + ": tool";
    tool.name = "tip";
    tool.shape = "ball";
    tool.size.radius_mm = 2;
  }
}

void refuse_empty(const SceneSpec& scene) {
  if (scene.volumes.empty()) {
    refuse(scene.path, ": no [[volume]]; write one with file = \"phantom\" or a path");
  }
  if (std::ranges::none_of(scene.volumes, &VolumeSpec::solid)) {
    refuse(scene.path,
           ": no [[volume]] is solid; set solid = true for the one that the tool touches");
  }
  if (scene.tools.empty()) {
    refuse(scene.path, ": no [[tool]]; write one with shape = \"ball\" and size_vox = 16");
  }
}

// Two arms: [[device]] twice, and [[hand]].

constexpr std::string_view kArmTables[] = {"device", "hand"};
/// Of the scene, not of one device: both hands are as large.
constexpr const char* kSharedKeys[] = {"workspace_scale", "fit"};

/// Leaves the first of each `[[device]]` and `[[hand]]` in the file, as if it stood alone, and
/// returns the second ones; empty if there is none. Another form stays as it is, and is refused
/// like that of any table.
std::optional<TomlNode> take_second_arm(TomlNode& root, const std::string& file) {
  TomlNode second;
  for (const std::string_view name : kArmTables) {
    if (root.find(name) == nullptr) continue;
    TomlNode& list = entry_of(root, name);
    const auto is_table = [](const TomlNode& node) { return node.form == TomlNode::Form::table; };
    if (list.form != TomlNode::Form::array || list.entries.empty() ||
        !std::ranges::all_of(list.entries, is_table)) {
      continue;
    }
    if (list.entries.size() > 2) {
      refuse(place_of(list, name, file), " has " + std::to_string(list.entries.size()) +
                                             " entries; use at most 2: a scene has two arms");
    }
    if (list.entries.size() == 2) {
      if (name == "hand" && second.entries.empty()) {
        refuse(
            file + ":" + std::to_string(list.entries[1].line) + ": hand",
            " is of a second device, and there is one; write a second [[device]], or one [hand]");
      }
      second.entries.push_back(std::move(list.entries[1]));
      second.entries.back().key = name;
    }
    TomlNode first = std::move(list.entries[0]);
    first.key = list.key;
    first.key_line = list.key_line;
    first.key_column = list.key_column;
    list = std::move(first);
  }
  if (second.entries.empty()) return std::nullopt;
  return second;
}

/// The settings of a command line that a second arm has too.
std::vector<KeyOverride> settings_of_arm(std::span<const KeyOverride> settings) {
  std::vector<KeyOverride> own;
  for (const KeyOverride& setting : settings) {
    const std::size_t dot = setting.key.find('.');
    const std::string_view table = std::string_view(setting.key).substr(0, dot);
    const bool is_shared =
        table == "device" &&
        std::ranges::find(kSharedKeys, setting.key.substr(dot + 1)) != std::end(kSharedKeys);
    if (std::ranges::find(kArmTables, table) != std::end(kArmTables) && !is_shared) {
      own.push_back(setting);
    }
  }
  return own;
}

/// The script of the tables' hand, from the scene's folder.
void finish_hand(const SceneTables& tables, const std::filesystem::path& path, std::string& script,
                 std::string& location) {
  if (script.empty()) return;
  script = (path.parent_path() / script).string();
  location = tables.once("hand").location("script");
}

SecondArm read_second_arm(const TomlNode& root, const std::filesystem::path& path, SceneKeys keys) {
  check_names(root, path.string(), keys);
  const SceneTables tables{root, path.string(), keys};
  SceneParts parts;
  for (const std::string_view name : kArmTables) tables.once(name).read(parts);
  for (const std::string_view name : kArmTables) tables.once(name).read_conditional(parts);
  const SceneTable device = tables.once("device");
  for (const char* key : kSharedKeys) {
    if (!device.has(key)) continue;
    refuse(device.location(key),
           " is the scene's, and both hands have it; write it in the first "
           "[[device]] alone");
  }
  finish_device(device, path, parts.scene);
  finish_hand(tables, path, parts.scene.hand_script, parts.scene.hand_location);
  return {.device = parts.scene.device,
          .offset_given = parts.scene.offset_given,
          .limits = {},
          .hand_script = parts.scene.hand_script,
          .hand_location = parts.scene.hand_location};
}

/// A motor's scale of one device is none of another's.
void refuse_one_scale(const SceneSpec& scene, std::span<const KeyOverride> settings) {
  if (!scene.second || scene.second->device.personality == scene.device.personality) return;
  if (std::ranges::find(settings, "device.torque_scale", &KeyOverride::key) == settings.end())
    return;
  refuse("--set device.torque_scale",
         ": the scene has two devices of different kinds; write each one's in its [[device]]");
}

/// The tool that a device names has to be one of the scene.
void check_tool_name(const DeviceSettings& device, const SceneSpec& scene) {
  std::vector<std::string_view> names;
  for (const ToolSpec& tool : scene.tools) names.push_back(tool.name);
  if (device.first_tool.empty() || std::ranges::find(names, device.first_tool) != names.end())
    return;
  refuse(device.tool_location, unknown_word(device.first_tool, names, "\""));
}

SceneSpec read_scene(const TomlNode& root, const TomlNode* second,
                     const std::filesystem::path& path, SceneKeys keys) {
  check_names(root, path.string(), keys);
  const SceneTables tables{root, path.string(), keys};
  SceneParts parts;
  SceneSpec& scene = parts.scene;
  scene.path = path.string();
  scene.materials = default_materials();
  read_lists(tables, parts);
  std::vector<SceneTable> once;
  for (const std::string_view name : names_below("", keys)) {
    if (most_of(name) == 0) once.push_back(tables.once(name));
  }
  for (const SceneTable& table : once) table.read(parts);
  fill_in(scene);
  refuse_empty(scene);
  choose_cut(tables.once("cut"), scene);
  for (const SceneTable& table : once) table.read_conditional(parts);
  finish_device(tables.once("device"), path, scene);
  if (second != nullptr) {
    scene.second = read_second_arm(*second, path, keys);
    scene.second->limits = scene.limits;
    check_tool_name(scene.second->device, scene);
  }
  check_tool_name(scene.device, scene);
  refuse_idle_coupling(tables.once("force"), scene.force);
  scene.limit_places = limit_places(tables.once("limits"));
  settle_device(scene);
  refuse_uncut(scene);
  refuse_idle_laws(scene);
  refuse_unfelt(scene);
  finish_hand(tables, path, scene.hand_script, scene.hand_location);
  return std::move(parts.scene);
}

/// `settle_device` of one arm.
void settle_arm(const SceneSpec& scene, const DeviceSettings& held, LimitSettings& limits) {
  // A motor count of a Cartesian device is 1 mN: a true force that is far from it is a slip.
  constexpr double kLeastShare = 0.1, kMostShare = 10;
  for (const double share : held.torque_scale.value_or(std::array{1.0, 1.0, 1.0})) {
    if (!is_cartesian(held.personality)) break;
    if (std::abs(share) >= kLeastShare && std::abs(share) <= kMostShare) continue;
    refuse(scene.path, ": device.torque_scale: " + number_text(share) + " is out of range for " +
                           std::string(word_of(held.personality)) +
                           ", true newtons per commanded newton; use 0.1 to 10, 1 to begin with");
  }
  const ForceFigures device = force_figures(held.personality);
  const auto settle = [&](const std::string& location, double low, double high, double own,
                          double& value) {
    if (location.empty()) {
      value = own;
    } else if (value < low || value > high) {
      refuse(location, " is out of range for " + std::string(word_of(held.personality)) + "; use " +
                           number_text(low) + " to " + number_text(high));
    }
  };
  constexpr double kLeastN = 0.01;
  settle(scene.limit_places.force, kLeastN, device.peak_n, device.peak_n, limits.force_n);
  settle(scene.limit_places.continuous, kLeastN, std::min(limits.force_n, device.peak_n),
         std::min(device.continuous_n, limits.force_n), limits.continuous_force_n);
  // The fade when reports are missing takes 15 ms: of the Omni's peak at least.
  constexpr double kFadeMs = 15, kLeastPeakN = 3.3;
  settle(scene.limit_places.slew, std::max(limits.force_n, kLeastPeakN) / kFadeMs,
         device.slew_n_per_ms, device.slew_n_per_ms, limits.slew_n_per_ms);
}

}  // namespace

void settle_device(SceneSpec& scene) {
  settle_arm(scene, scene.device, scene.limits);
  if (scene.second) settle_arm(scene, scene.second->device, scene.second->limits);
}

SceneSpec parse_scene(std::string_view text, const std::filesystem::path& path, SceneKeys keys,
                      std::span<const KeyOverride> settings) {
  try {
    TomlNode root = parse_toml(text);
    std::optional<TomlNode> second = take_second_arm(root, path.string());
    override_keys(settings, root);
    if (second) override_keys(settings_of_arm(settings), *second);
    spell_out_burs(root, path.string());
    SceneSpec scene = read_scene(root, second ? &*second : nullptr, path, keys);
    refuse_one_scale(scene, settings);
    return scene;
  } catch (const TomlError& error) {
    refuse(path.string() + ":" + std::to_string(error.line) + ":" + std::to_string(error.column),
           std::string(": ") + error.what());
  }
}

std::string read_scene_text(const std::filesystem::path& path) {
  constexpr std::uintmax_t kLargestFile = std::uintmax_t{1} << 20;
  std::error_code fault;
  if (const std::string why = access_error(path); !why.empty()) refuse(path.string(), why);
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
                              remedy_for(error, "check its permissions"));
  }
  std::string text;
  try {
    text.assign(std::istreambuf_iterator<char>(file), {});
  } catch (const std::ios_base::failure&) {
    refuse(path.string(), ": cannot be read; copy it again, or check its disk");
  }
  return text;
}

SceneSpec parse_scene_file(const std::filesystem::path& path,
                           std::span<const KeyOverride> settings) {
  return parse_scene(read_scene_text(path), path, scene_keys(), settings);
}

void check_hand_script(const SceneSettings& scene) {
  std::error_code fault;
  if (scene.hand_script.empty() || std::filesystem::is_regular_file(scene.hand_script, fault)) {
    return;
  }
  if (const std::string why = access_error(scene.hand_script); !why.empty()) {
    refuse(scene.hand_location, why);
  }
  refuse(scene.hand_location,
         " is no file in the scene's folder; copy the script there, or name one by its whole path");
}

}  // namespace kerf
