// SPDX-License-Identifier: Apache-2.0
#include "controller/load/scene_json.hpp"

#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include "controller/tool/tool_shapes.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

std::string content_hash(const VolumeImage& image) {
  std::uint64_t hash = kFnv1aBasis;
  for (const Density density : image.density) hash = fnv1a_bytes(hash, density, sizeof density);
  for (const Label label : image.labels) hash = fnv1a_step(hash, label);
  return hex64(hash);
}

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
          {"density_hash", content_hash(volume.image)}};
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

std::string canonical_json(const LoadedScene& scene, SceneKeys keys) {
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
  for (const Material& material : scene.materials) {
    parts.material = material;
    root["materials"].push_back(table_json("material", parts, keys));
  }
  return root.canonical();
}

}  // namespace kerf
