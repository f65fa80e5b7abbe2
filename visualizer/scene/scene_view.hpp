// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "shared/segment/pulp_heat.hpp"
#include "shared/segment/reader.hpp"
#include "shared/volume/brick_grid.hpp"
#include "visualizer/scene/camera.hpp"
#include "visualizer/scene/gradient_plan.hpp"

namespace kerf {

/// One volume as the visualizer needs it. Voxel (i, j, k) stands at
/// `world_from_voxel * (i, j, k, 1)`.
struct VolumeView {
  std::string name;
  BrickGrid bricks;
  glm::dmat4 world_from_voxel{1.0};  ///< voxel edges to mm
  Density iso = 32768;
  bool solid = true;

  /// Of its voxels.
  [[nodiscard]] glm::dvec3 edges_mm() const;
  /// Its box in the world, with the half voxel around.
  [[nodiscard]] BoxCorners corners() const;
  /// Half the diagonal of that box.
  [[nodiscard]] double radius_mm() const;
};

/// Of a voxel.
[[nodiscard]] inline double shortest_edge_mm(const glm::dmat4& world_from_voxel) {
  return std::min({glm::length(world_from_voxel[0]), glm::length(world_from_voxel[1]),
                   glm::length(world_from_voxel[2])});
}

/// What a renderer draws of a volume at this moment; spans of the caller, x fastest.
struct VolumeContent {
  std::span<const Density> density;
  std::span<const Label> labels;  ///< empty, or one per voxel
};

/// A closed mesh; counter-clockwise from the outside.
struct Facets {
  std::vector<std::array<double, 3>> points_mm;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// A tool as a body of revolution about its own y axis, or as a mesh; the shaft goes to +y.
struct ToolView {
  std::string name;
  std::vector<std::array<double, 2>> profile_mm;  ///< (y, radius), from the tip upwards
  double radius_mm = 0.0;                         ///< of the cutting head, at its widest
  /// Profile of shaft and handpiece if the servo loads them; if empty, the picture has a default
  /// one.
  std::vector<std::array<double, 2>> shaft_mm{};
  Facets facets{};  ///< instead of a profile
};

/// A material shows from density `iso` (0..1) upwards, or by its label, which is its index; index 0
/// stands for no material.
struct MaterialView {
  std::string name;
  double iso = 0.0;
  glm::dvec3 colour{0.9, 0.87, 0.8};  ///< linear RGB
  std::optional<double> opacity{};    ///< over `kOpacityMm`, 0..1; none: by its hardness
  bool forbidden = false;             ///< never cut, and reported when it is pressed
};

/// Gives each material but "none" its colour of material.hpp, which any kind of colour vision
/// distinguishes.
void take_okabe_ito(std::span<MaterialView> materials);

/// Where the device's own space lies in the world: world = offset + scale * device.
struct DeviceFrame {
  glm::dvec3 offset_mm{0.0};
  double scale = 1.0;
};

/// Everything about a session that does not change while it runs, with the view settings applied.
struct SceneView {
  std::vector<VolumeView> volumes;
  std::vector<ToolView> tools;
  std::vector<MaterialView> materials;
  DeviceFrame device{};                        ///< of the first arm
  std::size_t arms = 1;                        ///< each with a tool of its own in the hand
  GradientFilter gradient = kDefaultGradient;  ///< by which its volumes are shaded
  bool voxel_tool = false;                     ///< the tool of each arm is one volume more
  bool normals = false;                        ///< colours are normals in eye space (`SeenBodies`)
  bool has_spindle = false;                    ///< force cuts, and something turns the tool
  std::optional<PulpHeat> pulp;                ///< before the first tick; empty: no such mark

  /// Of the boxes of all volumes.
  [[nodiscard]] std::vector<glm::dvec3> corners() const;
  /// The first solid volume, else the first one.
  [[nodiscard]] const VolumeView& main_volume() const;
};

[[nodiscard]] glm::dmat4 rigid(const glm::dvec3& position_mm, const glm::dvec4& quaternion_xyzw);

/// Geometry from the segment's descriptors, names, tools and materials from its scene text. Throws
/// VisualizerError if the text is not what this version writes.
[[nodiscard]] SceneView scene_view(const SegmentInfo& segment);

/// A tool seen from the side, as rows from its tip upwards: height, left and right end, in mm.
using Silhouette = std::vector<std::array<double, 3>>;

/// Of the head, and, if the servo loads the shaft, of as much of that as the head is long. Empty if
/// the tool has no extent.
[[nodiscard]] Silhouette silhouette_of(const ToolView& tool);

}  // namespace kerf
