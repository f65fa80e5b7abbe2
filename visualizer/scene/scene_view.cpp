// SPDX-License-Identifier: Apache-2.0

#include "visualizer/scene/scene_view.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>

#include "shared/text/json.hpp"
#include "shared/volume/material.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf {

namespace {

constexpr std::size_t kMaxProfilePoints = 4096;  // a mesh of some 10^5 triangles

constexpr std::size_t kMaxTriangles = 65536;  // as the controller takes them

std::vector<std::array<double, 2>> profile_of(const Json& text, const ToolView& tool) {
  std::vector<std::array<double, 2>> profile;
  for (const Json& point : text) {
    const auto at = point.get<std::array<double, 2>>();
    if (!std::isfinite(at[0]) || !std::isfinite(at[1]) || at[1] < 0.0) {
      throw VisualizerError("segment scene: tool " + tool.name +
                            " has a profile point that is no height and radius; restart the "
                            "controller");
    }
    profile.push_back(at);
  }
  if (profile.size() > kMaxProfilePoints) {
    throw VisualizerError("segment scene: tool " + tool.name + " has " +
                          std::to_string(profile.size()) + " profile points; at most " +
                          std::to_string(kMaxProfilePoints));
  }
  return profile;
}

void read_facets(const Json& text, ToolView& tool) {
  Facets& facets = tool.facets;
  facets.points_mm = text.at("points_mm").get<decltype(facets.points_mm)>();
  facets.triangles = text.at("triangles").get<decltype(facets.triangles)>();
  const std::size_t points = facets.points_mm.size();
  const bool is_mesh =
      !facets.triangles.empty() && facets.triangles.size() <= kMaxTriangles &&
      std::ranges::all_of(facets.points_mm,
                          [](const auto& p) {
                            return std::ranges::all_of(p,
                                                       [](double x) { return std::isfinite(x); });
                          }) &&
      std::ranges::all_of(facets.triangles, [points](const auto& t) {
        return std::ranges::all_of(t, [points](std::uint32_t corner) { return corner < points; });
      });
  if (!is_mesh) {
    throw VisualizerError("segment scene: tool " + tool.name + " has a mesh that is none, of " +
                          std::to_string(points) + " points and " +
                          std::to_string(facets.triangles.size()) +
                          " triangles; restart the controller");
  }
  for (const auto& [x, y, z] : facets.points_mm) {
    tool.radius_mm = std::max(tool.radius_mm, std::hypot(x, z));
  }
}

ToolView tool_view(const Json& text) {
  ToolView tool;
  tool.name = text.at("name").get<std::string>();
  if (text.contains("mesh")) {
    read_facets(text.at("mesh"), tool);
  } else {
    tool.profile_mm = profile_of(text.at("profile"), tool);
    for (const auto& [y, radius] : tool.profile_mm) {
      tool.radius_mm = std::max(tool.radius_mm, radius);
    }
  }
  if (text.contains("shaft")) tool.shaft_mm = profile_of(text.at("shaft"), tool);
  return tool;
}

MaterialView material_view(const Json& text) {
  const auto colour = text.at("colour").get<std::array<double, 3>>();
  return {.name = text.at("name").get<std::string>(),
          .iso = text.at("iso").get<double>(),
          .colour = {colour[0], colour[1], colour[2]},
          .forbidden = text.contains("forbidden") && text.at("forbidden").get<bool>()};
}

DeviceFrame device_frame(const Json& text) {
  const auto offset = text.at("offset_mm").get<std::array<double, 3>>();
  return {{offset[0], offset[1], offset[2]}, text.at("workspace_scale").get<double>()};
}

VolumeView volume_view(const SegmentVolumeInfo& info) {
  const auto& q = info.orientation;
  const auto& o = info.origin_mm;
  const auto& s = info.spacing_mm;
  VolumeView volume;
  volume.bricks = info.bricks;
  volume.world_from_voxel =
      glm::scale(rigid({o[0], o[1], o[2]}, {q[0], q[1], q[2], q[3]}), glm::dvec3(s[0], s[1], s[2]));
  // Iso 0 would make the air around a volume solid.
  volume.iso = static_cast<Density>(std::clamp<std::uint32_t>(info.iso, 1, 65535));
  return volume;
}

}  // namespace

void take_okabe_ito(std::span<MaterialView> materials) {
  for (std::size_t m = 1; m < materials.size(); ++m) {
    const std::array<double, 3> colour = label_colour(m);
    materials[m].colour = {colour[0], colour[1], colour[2]};
  }
}

glm::dmat4 rigid(const glm::dvec3& position_mm, const glm::dvec4& q) {
  const glm::dquat rotation(q.w, q.x, q.y, q.z);
  const double length = glm::length(rotation);
  glm::dmat4 pose = length > 0.0 ? glm::mat4_cast(rotation / length) : glm::dmat4(1.0);
  pose[3] = glm::dvec4(position_mm, 1.0);
  return pose;
}

glm::dvec3 VolumeView::edges_mm() const {
  return {glm::length(world_from_voxel[0]), glm::length(world_from_voxel[1]),
          glm::length(world_from_voxel[2])};
}

BoxCorners VolumeView::corners() const {
  const VoxelGrid& n = bricks.grid;
  return box_corners(glm::dvec3(-0.5), {n.nx - 0.5, n.ny - 0.5, n.nz - 0.5}, world_from_voxel);
}

double VolumeView::radius_mm() const {
  const BoxCorners box = corners();
  return 0.5 * glm::length(box.back() - box.front());
}

std::vector<glm::dvec3> SceneView::corners() const {
  std::vector<glm::dvec3> all;
  for (const VolumeView& volume : volumes) {
    const BoxCorners box = volume.corners();
    all.insert(all.end(), box.begin(), box.end());
  }
  return all;
}

const VolumeView& SceneView::main_volume() const {
  const auto solid = std::find_if(volumes.begin(), volumes.end(),
                                  [](const VolumeView& volume) { return volume.solid; });
  return solid != volumes.end() ? *solid : volumes.front();
}

namespace {

/// The mark that the scene asks for.
std::optional<PulpHeat> pulp_heat(const Json& scene, std::uint32_t tick_ns) {
  if (!scene.contains("cut") || !scene.at("cut").contains("pulp")) return std::nullopt;
  const Json& cut = scene.at("cut");
  std::optional<double> water_c;
  if (cut.contains("water_c")) water_c = cut.at("water_c").get<double>();
  HeatingSpindle spindle;
  spindle.stall_torque_n_mm = scene.at("spindle").at("stall_torque_n_mm").get<double>();
  return PulpHeat(spindle, water_c, tick_ns * 1e-9);
}

}  // namespace

SceneView scene_view(const SegmentInfo& segment) {
  SceneView scene;
  scene.arms = segment.arms;
  for (const SegmentVolumeInfo& info : segment.volumes) scene.volumes.push_back(volume_view(info));
  try {
    const Json text = Json::parse(segment.scene_json);
    const Json& volumes = text.at("volumes");
    for (std::size_t i = 0; i < scene.volumes.size() && i < volumes.size(); ++i) {
      scene.volumes[i].name = volumes.at(i).at("name").get<std::string>();
      scene.volumes[i].solid = volumes.at(i).at("solid").get<bool>();
    }
    for (const Json& tool : text.at("tools")) scene.tools.push_back(tool_view(tool));
    if (text.contains("device")) scene.device = device_frame(text.at("device"));
    scene.has_spindle = text.contains("spindle");
    scene.pulp = pulp_heat(text, segment.tick_ns);
    for (const Json& one : text.at("materials")) scene.materials.push_back(material_view(one));
  } catch (const JsonError& problem) {
    throw VisualizerError("segment scene: " + std::string(problem.what()) +
                          "; start controller and visualizer of one version");
  }
  return scene;
}

namespace {

constexpr int kMeshRows = 24;  // as many as a small picture has pixels

/// Adds a body of revolution up to `end_mm`.
void add_profile(const std::vector<std::array<double, 2>>& profile, double end_mm,
                 Silhouette& rows) {
  for (std::size_t i = 0; i < profile.size(); ++i) {
    auto [y, radius] = profile[i];
    if (y > end_mm) {
      if (i == 0) return;
      const auto [before, from] = profile[i - 1];
      radius = from + (radius - from) * (end_mm - before) / (y - before);
      y = end_mm;
    }
    rows.push_back({y, -radius, radius});
    if (y >= end_mm) return;
  }
}

/// Where the edges of a mesh cross equal steps of height.
Silhouette rows_of(const Facets& facets) {
  double low = std::numeric_limits<double>::max(), high = -low;
  for (const auto& point : facets.points_mm) {
    low = std::min(low, point[1]);
    high = std::max(high, point[1]);
  }
  Silhouette rows;
  if (!(high > low)) return rows;
  for (int i = 0; i <= kMeshRows; ++i) {
    const double y = low + (high - low) * i / kMeshRows;
    std::array<double, 3> row{y, std::numeric_limits<double>::max(),
                              -std::numeric_limits<double>::max()};
    for (const auto& triangle : facets.triangles) {
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const auto& a = facets.points_mm[triangle[corner]];
        const auto& b = facets.points_mm[triangle[(corner + 1) % 3]];
        if (std::min(a[1], b[1]) > y || std::max(a[1], b[1]) < y) continue;
        const double fraction = b[1] != a[1] ? (y - a[1]) / (b[1] - a[1]) : 0.0;
        const double x = a[0] + (b[0] - a[0]) * fraction;
        row = {y, std::min(row[1], x), std::max(row[2], x)};
      }
    }
    if (row[1] <= row[2]) rows.push_back(row);
  }
  return rows;
}

}  // namespace

Silhouette silhouette_of(const ToolView& tool) {
  Silhouette rows;
  if (tool.profile_mm.empty()) {
    rows = rows_of(tool.facets);
  } else {
    add_profile(tool.profile_mm, std::numeric_limits<double>::max(), rows);
  }
  if (rows.empty() || !(rows.back()[0] > rows.front()[0])) return {};
  const double head_end = rows.back()[0];
  Silhouette shaft;
  add_profile(tool.shaft_mm, head_end + (head_end - rows.front()[0]), shaft);
  for (const auto& [y, left, right] : shaft) {
    if (y <= head_end) continue;
    if (rows.back()[0] == head_end) rows.push_back({head_end, left, right});
    rows.push_back({y, left, right});
  }
  return rows;
}

}  // namespace kerf
