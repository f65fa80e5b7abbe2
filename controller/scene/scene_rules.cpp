// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/scene_rules.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>

#include "controller/scene/materials.hpp"
#include "controller/scene/scene_text.hpp"

namespace kerf {
namespace {

std::string stem_of(const std::string& file) {
  return std::filesystem::path(file).stem().string();
}

void make_unit(const SceneTable& table, std::array<double, 4>& q) {
  constexpr double kTolerance = 0.01;  // rounded by hand, not forgotten
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (std::abs(length - 1) > kTolerance) {
    refuse(table.place("pose.orientation"),
           " has length " + short_text(length) + "; write a unit quaternion [x, y, z, w]");
  }
  for (double& component : q) component /= length;
}

/// Of a solid of revolution; a mesh has its own size.
void check_size(const SceneTable& table, const ToolSpec& tool) {
  const ToolSize& size = tool.size;
  if (!table.has("radius_mm") && !table.has("size_vox")) {
    refuse(table.place(), " needs either radius_mm or size_vox; write one of them");
  }
  if (table.has("radius_mm") && table.has("size_vox")) {
    refuse(table.place("radius_mm"), " contradicts size_vox; leave one of the two out");
  }
  if (!size.length_mm) return;
  if (size.size_vox) {
    refuse(table.place("length_mm"), " contradicts size_vox, which is a cube; leave it out");
  }
  if (tool.shape == "ball") {
    refuse(table.place("length_mm"), " contradicts the ball, which is round; leave it out");
  }
  if (tool.shape == "wheel" && *size.length_mm > 2 * size.radius_mm) {
    refuse(table.place("length_mm"),
           " is more than the wheel's diameter; use at most " + number_text(2 * size.radius_mm));
  }
}

/// Of any tool; what the head's own length forbids is told once that is known (load_tool.cpp).
void check_shaft(const SceneTable& table, ToolSpec& tool) {
  const ShaftSize& shaft = tool.shaft;
  if (shaft.radius_mm && !shaft.length_mm) {
    refuse(table.place("shaft_radius_mm"),
           " has no length; write shaft_length_mm, from the tool's tip to the shaft's end");
  }
  if (shaft.length_mm && !shaft.radius_mm) {
    refuse(table.place("shaft_length_mm"), " has no radius; write shaft_radius_mm");
  }
  if (shaft.handpiece_radius_mm && !shaft.radius_mm) {
    refuse(table.place("handpiece_radius_mm"),
           " has no shaft to hold; write shaft_radius_mm and shaft_length_mm");
  }
  if (shaft.handpiece_length_mm && !shaft.handpiece_radius_mm) {
    refuse(table.place("handpiece_length_mm"), " has no radius; write handpiece_radius_mm");
  }
  if (shaft.handpiece_radius_mm && *shaft.handpiece_radius_mm < *shaft.radius_mm) {
    refuse(table.place("handpiece_radius_mm"),
           " is narrower than the shaft; use at least " + number_text(*shaft.radius_mm));
  }
  if (shaft.length_mm) tool.shaft_place = table.place("shaft_length_mm");
}

}  // namespace

void finish_volume(const SceneTable& table, VolumeSpec& volume) {
  volume.where = table.where("file");
  if (!table.has("name")) volume.name = stem_of(volume.file);
  if (volume.window && (*volume.window)[0] >= (*volume.window)[1]) {
    refuse(table.place("window"), " is empty; write [low, high] with low < high");
  }
  if (volume.orientation) make_unit(table, *volume.orientation);
}

void finish_tool(const SceneTable& table, ToolSpec& tool) {
  std::string name;
  if (tool.shape == kMeshShape) {
    tool.where = table.where("file");
    tool.size_place = table.place("file");
    name = stem_of(tool.file);
  } else {
    check_size(table, tool);
    const bool in_voxels = tool.size.size_vox.has_value();
    tool.size_place = table.place(in_voxels ? "size_vox" : "radius_mm");
    name = tool.shape + " " +
           (in_voxels ? std::to_string(*tool.size.size_vox) + " vox"
                      : number_text(tool.size.radius_mm) + " mm");
  }
  check_shaft(table, tool);
  tool.pitch_given = table.has("pitch_mm");
  if (tool.pitch_given) tool.pitch_place = table.place("pitch_mm");
  if (!table.has("name")) tool.name = name;
}

Material& material_named(const SceneTable& table, const std::string& name,
                         std::vector<Material>& materials) {
  if (name == materials.front().name) {
    refuse(table.place("name"), " is air and has no properties; use another name");
  }
  const auto material = std::ranges::find(materials, name, &Material::name);
  return material != materials.end() ? *material : materials.emplace_back(known_material(name));
}

void finish_device(const SceneTable& table, Scene& scene) {
  scene.offset_given = table.has("offset_mm");
  for (const double sign : scene.device.encoder_sign.value_or(std::array{1.0, 1.0, 1.0})) {
    if (std::abs(sign) == 1) continue;
    refuse(
        table.place("encoder_sign"),
        " is not 1 or -1 at each joint; ./kerf controller --probe shows which (docs/devices.md)");
  }
  if (!scene.device.torque_scale) return;
  for (const double scale : *scene.device.torque_scale) {
    if (std::abs(scale) >= kMinTorqueScale) continue;
    refuse(table.place("torque_scale"),
           " is below 0.001 N mm per count; leave the key out to keep the motors off");
  }
}

void choose_cut(const SceneTable& table, Scene& scene) {
  scene.cut_in_one_tick = table.is_text("rate_per_s");
  if (scene.force.model == ForceModel::paper && !table.has("model")) {
    scene.cut.model = CutModel::overlap;
  }
}

void refuse_uncut(const Scene& scene) {
  if (scene.cut.model == CutModel::none || scene.cut.model == CutModel::preston) return;
  for (const Material& material : scene.materials) {
    if (!material.forbidden) continue;
    refuse(scene.path, ": material " + material.name +
                           " is forbidden, and this cut.model cuts everything; set model "
                           "= \"preston\", or leave forbidden out");
  }
}

void refuse_unfelt(const Scene& scene) {
  if (scene.force.model == ForceModel::proxy) return;
  for (const ToolSpec& tool : scene.tools) {
    if (!tool.shaft.length_mm) continue;
    refuse(tool.shaft_place,
           " is felt by a proxy alone; set force.model = \"proxy\", or leave the shaft out");
  }
}

void refuse_idle_coupling(const SceneTable& table, const ForceSettings& force) {
  if (force.law.name.empty()) return;
  for (const char* key : {"stiffness_n_per_mm", "damping_ns_per_mm"}) {
    if (table.has(key)) {
      refuse(table.place(key), " is of the coupling, and force.law is in its place; leave it out");
    }
  }
}

void finish_limits(const SceneTable& table, LimitSettings& limits) {
  if (limits.continuous_force_n <= limits.force_n) return;
  if (table.has("continuous_force_n")) {
    refuse(table.place("continuous_force_n"),
           " is out of range; use 0.01 to " + number_text(limits.force_n));
  }
  limits.continuous_force_n = limits.force_n;
}

}  // namespace kerf
