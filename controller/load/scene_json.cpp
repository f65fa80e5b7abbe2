// SPDX-License-Identifier: Apache-2.0
#include "controller/load/scene_json.hpp"

#include <array>
#include <utility>

#include "controller/scene/scene_words.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "shared/text/json.hpp"

namespace kerf {
namespace {

constexpr std::uint64_t kFnvBasis = 0xcbf29ce484222325;
constexpr std::uint64_t kFnvPrime = 0x100000001b3;

std::uint64_t fnv1a_byte(std::uint64_t hash, std::uint8_t byte) {
  return (hash ^ byte) * kFnvPrime;
}

std::string content_hash(const VolumeImage& image) {
  std::uint64_t hash = kFnvBasis;
  for (const Density density : image.density) {  // low byte first, whatever the machine
    hash = fnv1a_byte(hash, static_cast<std::uint8_t>(density & 0xff));
    hash = fnv1a_byte(hash, static_cast<std::uint8_t>(density >> 8));
  }
  for (const Label label : image.labels) hash = fnv1a_byte(hash, label);
  std::string digits(16, '0');
  for (std::size_t i = digits.size(); i-- > 0; hash >>= 4)
    digits[i] = "0123456789abcdef"[hash & 15];
  return digits;
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
  if (tool.mesh.triangles.empty()) {
    object["profile"] = tool_profile(tool);
  } else {
    object["mesh"] = {{"points_mm", tool.mesh.points_mm}, {"triangles", tool.mesh.triangles}};
  }
  return object;
}

Json material_json(const Material& material) {
  Json object = {{"name", material.name},
                 {"iso", material.iso},
                 {"machinability", material.machinability},
                 {"colour", material.colour}};
  if (material.forbidden) object["forbidden"] = true;
  return object;
}

Json force_json(const ForceSettings& force) {
  if (force.model == ForceModel::paper) {
    return {{"model", word_of(force.model)}, {"p0_n_per_mm2", force.p0_n_per_mm2}};
  }
  return {{"model", word_of(force.model)},
          {"stiffness_n_per_mm", force.stiffness_n_per_mm},
          {"damping_ns_per_mm", force.damping_ns_per_mm},
          {"friction", force.friction}};
}

/// What the model of cutting uses.
Json cut_json(const CutSettings& cut) {
  Json object = {{"model", word_of(cut.model)}};
  if (cut.model == CutModel::preston) {
    object["machinability_mm3_per_s_n"] = cut.machinability_mm3_per_s_n;
    object["threshold_n"] = cut.threshold_n;
    object["friction"] = cut.friction;
  } else {
    object["rate_per_s"] = cut.rate_per_s;
    object["p1_n_per_mm2"] = cut.p1_n_per_mm2;
  }
  return object;
}

Json device_json(const DeviceSettings& device) {
  Json object = {{"personality", kPersonalityWords[static_cast<std::size_t>(device.personality)]},
                 {"workspace_scale", device.workspace_scale},
                 {"offset_mm", device.offset_mm},
                 {"dock_rad", device.dock_rad}};
  if (device.torque_scale) object["torque_scale"] = *device.torque_scale;
  return object;
}

}  // namespace

std::string canonical_json(const LoadedScene& scene) {
  Json volumes = Json::List{};
  for (const SceneVolume& volume : scene.volumes) volumes.push_back(volume_json(volume));
  Json tools = Json::List{};
  for (const SceneTool& tool : scene.tools) tools.push_back(tool_json(tool));
  Json materials = Json::List{};
  for (const Material& material : scene.materials) materials.push_back(material_json(material));

  Json root = {{"volumes", std::move(volumes)},
               {"tools", std::move(tools)},
               {"active_tool", scene.active_tool},
               {"materials", std::move(materials)},
               {"device", device_json(scene.device)},
               {"force", force_json(scene.force)},
               {"cut", cut_json(scene.cut)},
               {"limits",
                {{"force_n", scene.limits.force_n},
                 {"continuous_force_n", scene.limits.continuous_force_n},
                 {"slew_n_per_ms", scene.limits.slew_n_per_ms},
                 {"speed_mm_per_s", scene.limits.speed_mm_per_s}}},
               {"servo",
                {{"rate_hz", scene.servo.rate_hz},
                 {"numeric", word_of(scene.servo.numeric)},
                 {"kernel", word_of(scene.servo.kernel)}}}};
  if (scene.cut.model == CutModel::preston) {
    root["spindle"] = {{"speed_krpm", scene.spindle.speed_krpm},
                       {"stall_torque_n_mm", scene.spindle.stall_torque_n_mm},
                       {"inertia_g_mm2", scene.spindle.inertia_g_mm2}};
  }
  return root.canonical();
}

std::uint64_t fnv1a(std::string_view bytes) {
  std::uint64_t hash = kFnvBasis;
  for (const char byte : bytes) hash = fnv1a_byte(hash, static_cast<std::uint8_t>(byte));
  return hash;
}

std::uint64_t config_hash(const LoadedScene& scene) {
  return fnv1a(canonical_json(scene));
}

}  // namespace kerf
