// SPDX-License-Identifier: Apache-2.0
#include "controller/load/scene_json.hpp"

#include <array>
#include <utility>

#include <nlohmann/json.hpp>

#include "controller/scene/scene_words.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/posix/hex64.hpp"

namespace kerf {
namespace {

using nlohmann::json;

std::string content_hash(const VolumeImage& image) {
  std::uint64_t hash = kFnv1aBasis;
  for (const Density density : image.density) hash = fnv1a_bytes(hash, density, sizeof density);
  for (const Label label : image.labels) hash = fnv1a_step(hash, label);
  return hex64(hash);
}

json volume_json(const SceneVolume& volume) {
  const VoxelGrid& grid = volume.image.grid;
  return {{"name", volume.name},
          {"file", volume.file},
          {"iso", volume.iso},
          {"solid", volume.solid},
          {"spacing_mm", volume.image.spacing_mm},
          {"grid", {grid.nx, grid.ny, grid.nz}},
          {"pose",
           {{"position_mm", volume.pose.position_mm}, {"orientation", volume.pose.orientation}}},
          {"density_hash", content_hash(volume.image)}};
}

json tool_json(const SceneTool& tool) {
  json offsets = json::array();
  for (const ToolOffset& offset : tool.offsets) {
    for (const std::int16_t component : offset) offsets.push_back(component);
  }
  json object = {{"name", tool.name},
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

json material_json(const Material& material) {
  json object = {{"name", material.name},
                 {"iso", material.iso},
                 {"machinability", material.machinability},
                 {"colour", material.colour}};
  if (material.forbidden) object["forbidden"] = true;
  return object;
}

json force_json(const ForceSettings& force) {
  if (force.model == ForceModel::paper) {
    return {{"model", word_of(force.model)}, {"p0_n_per_mm2", force.p0_n_per_mm2}};
  }
  return {{"model", word_of(force.model)},
          {"stiffness_n_per_mm", force.stiffness_n_per_mm},
          {"damping_ns_per_mm", force.damping_ns_per_mm},
          {"friction", force.friction}};
}

/// What the model of cutting uses.
json cut_json(const CutSettings& cut) {
  json object = {{"model", word_of(cut.model)}};
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

json device_json(const DeviceSettings& device) {
  json object = {{"personality", kPersonalityWords[static_cast<std::size_t>(device.personality)]},
                 {"workspace_scale", device.workspace_scale},
                 {"offset_mm", device.offset_mm},
                 {"dock_rad", device.dock_rad}};
  if (device.torque_scale) object["torque_scale"] = *device.torque_scale;
  return object;
}

}  // namespace

std::string canonical_json(const LoadedScene& scene) {
  json volumes = json::array();
  for (const SceneVolume& volume : scene.volumes) volumes.push_back(volume_json(volume));
  json tools = json::array();
  for (const SceneTool& tool : scene.tools) tools.push_back(tool_json(tool));
  json materials = json::array();
  for (const Material& material : scene.materials) materials.push_back(material_json(material));

  json root = {{"volumes", std::move(volumes)},
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
  // A path need not be UTF-8; what is not, is replaced.
  return root.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::uint64_t config_hash(const LoadedScene& scene) {
  return fnv1a(canonical_json(scene));
}

}  // namespace kerf
