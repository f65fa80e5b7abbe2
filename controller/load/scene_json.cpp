// SPDX-License-Identifier: Apache-2.0
#include "controller/load/scene_json.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>
#include <variant>

#include "controller/scene/scene_file.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"
#include "shared/volume/checksum.hpp"

namespace kerf {
namespace {

Json volume_json(const SceneVolume& volume) {
  const VoxelGrid& grid = volume.image.grid;
  return {{"name", volume.name},
          {"file", volume.file},
          {"iso", volume.iso},
          {"solid", volume.solid},
          {"spacing_mm", volume.image.spacing_mm},
          {"grid", std::array{grid.nx, grid.ny, grid.nz}},
          {"pose",
           {{"position_mm", volume.pose.position_mm}, {"orientation", volume.pose.orientation}}},
          {"density_hash", hex64(volume_hash(volume.image.density, volume.image.labels))}};
}

Json tool_json(const SceneTool& tool) {
  Json offsets = Json::List{};
  for (const ToolOffset& offset : tool.offsets) {
    for (const std::int16_t component : offset) offsets.push_back(component);
  }
  Json object = {{"name", tool.name},
                 {"shape", tool.shape},
                 {"pitch_mm", tool.pitch_mm},
                 {"radius_mm", tool.radius_mm},
                 {"length_mm", tool.length_mm},
                 {"round", tool.round},
                 {"turns", tool.turns},
                 {"size_vox", tool.size_vox},
                 {"offsets_half_pitch", std::move(offsets)}};
  if (tool.law != BurLaw{}) {
    object["law"] = {{"force_exponent", tool.law.force_exponent},
                     {"speed_exponent", tool.law.speed_exponent},
                     {"saturation_n", tool.law.saturation_n},
                     {"wear_half_n_s", tool.law.wear_half_n_s}};
  }
  if (tool.shaft.radius_mm > 0) object["shaft"] = shaft_profile(tool);
  if (tool.mesh.triangles.empty()) {
    object["profile"] = tool_profile(tool);
  } else {
    object["mesh"] = {{"points_mm", tool.mesh.points_mm}, {"triangles", tool.mesh.triangles}};
  }
  return object;
}

Json json_of(const TomlValue& value) {
  const auto convert = [](const auto& held) -> Json {
    using T = std::remove_cvref_t<decltype(held)>;
    if constexpr (std::is_same_v<T, std::monostate>) {
      return nullptr;
    } else if constexpr (std::is_same_v<T, NamedNumbers>) {
      Json object = {{"name", held.name}};
      for (const auto& [name, number] : held.numbers) object[name] = number;
      return object;
    } else {
      return held;
    }
  };
  return std::visit(convert, value);
}

/// The keys of a table that go to readers, by their rows and the scene's models; null if none does.
Json table_json(std::string_view table, SceneParts& parts, SceneKeys keys) {
  Json object;
  SceneParts defaults;
  for (const SceneKey& key : keys_of(table, keys)) {
    const InJson shown = key.options.json;
    if (shown == InJson::never || (shown != InJson::always && !is_used(key, parts))) continue;
    const TomlValue value = value_of(key, parts);
    if (std::holds_alternative<std::monostate>(value)) continue;
    if (shown == InJson::if_changed && value == value_of(key, defaults)) continue;
    object[name_in_table(key)] = json_of(value);
  }
  return object;
}

}  // namespace

Json scene_json(const LoadedScene& scene, SceneKeys keys) {
  Json volumes = Json::List{};
  for (const SceneVolume& volume : scene.volumes) volumes.push_back(volume_json(volume));
  Json tools = Json::List{};
  for (const SceneTool& tool : scene.tools) tools.push_back(tool_json(tool));
  Json root = {{"volumes", std::move(volumes)},
               {"tools", std::move(tools)},
               {"active_tool", scene.active_tool},
               {"materials", Json::List{}}};
  SceneParts parts;
  static_cast<SceneSettings&>(parts.scene) = scene;
  for (const std::string_view table : names_below("", keys)) {
    if (most_of(table) > 0) continue;
    Json object = table_json(table, parts, keys);
    if (!object.is_null()) root[table] = std::move(object);
  }
  if (scene.second) {
    SceneParts second = parts;
    second.scene.device = scene.second->device;
    second.scene.limits = scene.second->limits;
    root["second_device"] = table_json("device", second, keys);
    root["second_limits"] = table_json("limits", second, keys);
    root["second_tool"] = scene.second_tool;
  }
  for (const Material& material : scene.materials) {
    parts.material = material;
    root["materials"].push_back(table_json("material", parts, keys));
  }
  return root;
}

std::string canonical_json(const LoadedScene& scene, SceneKeys keys) {
  return scene_json(scene, keys).canonical();
}

namespace {

constexpr std::string_view kSource = "source";

std::filesystem::path absolute_path(const std::filesystem::path& path) {
  std::error_code fault;
  const std::filesystem::path whole = std::filesystem::absolute(path, fault).lexically_normal();
  return fault ? path : whole;
}

template <class T>
void put(Json& object, std::string_view key, const std::optional<T>& value) {
  if (value) object[key] = *value;
}

template <class T>
void take(const Json& object, std::string_view key, std::optional<T>& value) {
  if (object.contains(key)) value = object.at(key).get<T>();
}

template <class Kind, std::size_t N>
void put_word(Json& object, std::string_view key, const std::optional<Kind>& kind,
              const std::array<std::string_view, N>& words) {
  if (kind) object[key] = words[static_cast<std::size_t>(*kind)];
}

template <class Kind, std::size_t N>
void take_word(const Json& object, std::string_view key, std::optional<Kind>& kind,
               const std::array<std::string_view, N>& words) {
  if (!object.contains(key)) return;
  const auto word = std::ranges::find(words, object.at(key).get<std::string>());
  if (word == words.end()) throw JsonError(std::string(key) + ": no such word");
  kind = static_cast<Kind>(word - words.begin());
}

Json json_of(const SceneSource& source) {
  const SceneOverrides& given = source.overrides;
  Json out = {{"scene", source.path.string()}, {"text", source.text}};
  for (const KeyOverride& setting : given.settings) {
    out["settings"].push_back(setting.key + "=" + setting.value);
  }
  if (given.volume_file) {
    VolumeSpec volume;
    volume.file = given.volume_file->string();
    out["volume"] = is_phantom(volume) ? volume.file : absolute_path(*given.volume_file).string();
  }
  put(out, "spacing_mm", given.spacing_mm);
  put(out, "override_spacing_mm", given.override_spacing_mm);
  put(out, "window", given.window);
  put(out, "rate_hz", given.rate_hz);
  put_word(out, "numeric", given.numeric, kNumericWords);
  put_word(out, "device", given.personality, kPersonalityWords);
  put(out, "torque_scale", given.torque_scale);
  put(out, "second_torque_scale", given.second_torque_scale);
  out["unchecked_gain"] = given.unchecked_gain;
  out["pedal"] = given.pedal;
  out["read_seconds"] = given.read_cpu_s;
  return out;
}

}  // namespace

SceneSource read_source(const std::filesystem::path& scene, const SceneOverrides& overrides) {
  return {absolute_path(scene), read_scene_text(scene), overrides};
}

LoadedScene load_scene(const SceneSource& source, RecordedInputs recorded) {
  return load_scene(source.path, source.text, source.overrides, std::move(recorded));
}

std::string json_with_source(Json root, const LoadedScene& scene, const SceneSource& source) {
  root[kSource] = json_of(source);
  for (const Material& material : scene.volumes.front().proposed) {
    root[kSource]["proposed"].push_back(
        {{"name", material.name}, {"iso", material.iso}, {"colour", material.colour}});
  }
  return root.canonical();
}

namespace {

SceneVolume volume_in(const Json& json) {
  SceneVolume volume{.name = json.at("name").get<std::string>(),
                     .file = json.at("file").get<std::string>(),
                     .iso = json.at("iso").get<Density>(),
                     .solid = json.at("solid").get<bool>()};
  const auto [nx, ny, nz] = json.at("grid").get<std::array<std::int32_t, 3>>();
  check_grid(one_line(volume.name), nx, ny, nz);
  volume.image.grid = {nx, ny, nz};
  volume.image.spacing_mm = json.at("spacing_mm").get<std::array<double, 3>>();
  check_spacing(one_line(volume.name), volume.image.spacing_mm);
  const Json& pose = json.at("pose");
  volume.pose = {pose.at("position_mm").get<std::array<double, 3>>(),
                 pose.at("orientation").get<std::array<double, 4>>()};
  return volume;
}

ToolMesh mesh_in(const Json& json) {
  ToolMesh mesh;
  for (const Json& point : json.at("points_mm")) {
    mesh.points_mm.push_back(point.get<ToolMesh::Point>());
  }
  for (const Json& triangle : json.at("triangles")) {
    mesh.triangles.push_back(triangle.get<ToolMesh::Triangle>());
    if (std::ranges::max(mesh.triangles.back()) >= mesh.points_mm.size()) {
      throw JsonError("mesh.triangles: no such point");
    }
  }
  return mesh;
}

}  // namespace

InputsInJson inputs_in(std::string_view json) {
  const Json scene = Json::parse(json);
  InputsInJson out;
  for (const Json& volume : scene.at("volumes")) {
    if (out.density_hashes.size() == kMaxVolumes) throw JsonError("volumes: too many");
    out.inputs.volumes.push_back(volume_in(volume));
    out.density_hashes.push_back(volume.at("density_hash").get<std::string>());
  }
  if (out.inputs.volumes.empty()) throw JsonError("volumes: none");
  if (const Json& source = scene.at(kSource); source.contains("proposed")) {
    for (const Json& material : source.at("proposed")) {
      out.inputs.volumes.front()->proposed.push_back(
          {.name = material.at("name").get<std::string>(),
           .iso = material.at("iso").get<double>(),
           .colour = material.at("colour").get<std::array<double, 3>>()});
    }
  }
  for (const Json& tool : scene.at("tools")) {
    if (!tool.contains("mesh")) continue;
    out.inputs.meshes.emplace_back(tool.at("name").get<std::string>(), mesh_in(tool.at("mesh")));
  }
  return out;
}

SceneSource source_in(std::string_view json) {
  const Json scene = Json::parse(json);
  const Json& source = scene.at(kSource);
  SceneSource out{source.at("scene").get<std::string>(), source.at("text").get<std::string>(), {}};
  SceneOverrides& given = out.overrides;
  if (source.contains("settings")) {
    for (const Json& text : source.at("settings")) {
      given.settings.push_back(parse_setting(text.get<std::string>()));
    }
  }
  if (source.contains("volume")) given.volume_file = source.at("volume").get<std::string>();
  take(source, "spacing_mm", given.spacing_mm);
  take(source, "override_spacing_mm", given.override_spacing_mm);
  take(source, "window", given.window);
  take(source, "rate_hz", given.rate_hz);
  take_word(source, "numeric", given.numeric, kNumericWords);
  take_word(source, "device", given.personality, kPersonalityWords);
  take(source, "torque_scale", given.torque_scale);
  take(source, "second_torque_scale", given.second_torque_scale);
  given.unchecked_gain = source.at("unchecked_gain").get<bool>();
  given.pedal = source.at("pedal").get<bool>();
  given.read_cpu_s = source.at("read_seconds").get<int>();
  return out;
}

std::string json_without_source(std::string_view json) {
  return Json::parse(json).without(kSource).canonical();
}

}  // namespace kerf
