// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "visualizer/scene/scene_view.hpp"

namespace kerf {

/// Triangles with a normal per vertex; counter-clockwise from the outside.
struct Mesh {
  struct Vertex {
    glm::vec3 position;
    glm::vec3 normal;
  };
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> triangles;  ///< three indices each

  void append(const Mesh& other);
};

/// A profile point: height on the axis (y) and distance from it.
using ProfilePoint = std::array<double, 2>;

/// The closed body that `profile` (from low to high y) sweeps about the y axis; flat lids close an
/// end that is not on the axis. Edges sharper than 40 degrees stay sharp. Empty for fewer than two
/// points.
[[nodiscard]] Mesh lathe(std::span<const ProfilePoint> profile);

/// A closed mesh with normals. Edges sharper than 40 degrees stay sharp.
[[nodiscard]] Mesh shaded(const Facets& facets);

/// What a bur is made of: the head by its profile (mm), and the shaft behind it if the servo loads
/// that; else a shank along +y, thinner than the head, that begins inside it. Neither if the head
/// has no extent. A head that is a mesh has no outline.
using Outlines = std::vector<std::vector<ProfilePoint>>;
[[nodiscard]] Outlines tool_outlines(const ToolView& tool);
/// All of it as a mesh.
[[nodiscard]] Mesh tool_mesh(const ToolView& tool);

/// Cylinder of radius 1 from y = 0 to 1, and cone of base radius 1 from y = 0 to its tip at 1.
[[nodiscard]] Mesh unit_cylinder();
[[nodiscard]] Mesh unit_cone();

}  // namespace kerf
