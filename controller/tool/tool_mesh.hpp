// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace kerf {

/// Largest mesh of a tool: a picture of it and its text in the segment stay small.
inline constexpr std::size_t kMaxMeshTriangles = 65536;
inline constexpr double kLargestMeshMm = 1000;  ///< farthest coordinate: a slip of the unit shows

/// The closed surface of a tool in its own frame: the spindle turns about y, the shaft is toward
/// +y, and the middle of its height is at y = 0. Whole nanometres, so that they are short as text.
struct ToolMesh {
  using Point = std::array<double, 3>;
  using Triangle = std::array<std::uint32_t, 3>;  ///< counter-clockwise from outside

  std::vector<Point> points_mm;
  std::vector<Triangle> triangles;

  [[nodiscard]] std::array<Point, 3> corners(const Triangle& t) const {
    return {points_mm[t[0]], points_mm[t[1]], points_mm[t[2]]};
  }
};

/// A triangle before its corners are known to be those of others.
using LooseTriangle = std::array<std::array<float, 3>, 3>;

/// Joins triangles at corners of equal coordinates. `scale` is mm per unit of theirs; `place`
/// begins a complaint. Triangles with two equal corners are left out. A mesh that is turned inside
/// out is turned back, and so is each part of it, joined by edges, that is no hollow in another.
///
/// Throws SceneError for coordinates beyond kLargestMeshMm, for an edge without a partner, for
/// neighbours that are turned against each other, and where nothing is enclosed. Load time.
[[nodiscard]] ToolMesh join_triangles(std::span<const LooseTriangle> triangles, double scale,
                                      const std::string& place);

}  // namespace kerf
