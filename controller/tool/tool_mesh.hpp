// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "controller/input/sandbox.hpp"
#include "shared/numeric/linear_algebra.hpp"

// The closed mesh of a tool, and the STL file that it comes from.

namespace kerf {

/// Largest mesh of a tool, so that a picture of it and its text in the segment stay small.
inline constexpr std::size_t kMaxMeshTriangles = 65536;
inline constexpr double kLargestMeshMm =
    1000;  ///< farthest coordinate, so that a wrong unit is noticed

/// The closed surface of a tool in its own frame: the spindle turns about y, the shaft is toward
/// +y, and the middle of its height is at y = 0. Whole nanometres, so that they are short as text.
struct ToolMesh {
  using Point = vec3::Vec;
  using Triangle = std::array<std::uint32_t, 3>;  ///< counter-clockwise from outside

  std::vector<Point> points_mm;
  std::vector<Triangle> triangles;

  [[nodiscard]] std::array<Point, 3> corners(const Triangle& t) const {
    return {points_mm[t[0]], points_mm[t[1]], points_mm[t[2]]};
  }
};

/// Throws LoadError unless `join_triangles` could have made the mesh; each triangle has points.
void check_mesh(const ToolMesh& mesh, const std::string& location);

/// A triangle whose corners are not yet joined with those of others.
using LooseTriangle = std::array<std::array<float, 3>, 3>;

/// Joins triangles at corners of equal coordinates; if that closes no mesh, at corners that the
/// rounding of their numbers sets apart: four steps of a float, then one unit of the sixth digit,
/// of the largest coordinate. `scale` is mm per unit of theirs; `location` begins each message.
/// Triangles with two equal corners are left out. An inside-out mesh is turned outward, and so is
/// each part of it, joined by edges, that is no hollow in another.
///
/// Throws LoadError for coordinates beyond kLargestMeshMm, for an edge without a partner, for
/// neighbours of opposite orientation, and if no volume is enclosed. Load time.
[[nodiscard]] ToolMesh join_triangles(std::span<const LooseTriangle> triangles, double scale,
                                      const std::string& location);

/// Largest STL file: as text a triangle takes some 300 bytes.
inline constexpr std::uintmax_t kMaxStlBytes = std::uintmax_t{512} * kMaxMeshTriangles;

/// The triangles of an STL file, binary or text, in the file's own unit; its normals are not read.
///
/// Binary: 80 bytes of header, u32 count, then 50 bytes each: normal and three corners as f32, and
/// two unused bytes; little-endian. Text: `solid`, `facet normal`, `outer loop`, three
/// `vertex`, `endloop`, `endfacet`, `endsolid`, in any case, or `end loop` and so on; the last
/// `endsolid` may be missing, and several solids are one mesh. A file
/// whose size is that of its binary count is binary, with any first word; any other without a zero
/// byte is text.
///
/// `location` begins a complaint. Throws LoadError with the line or the number of bytes for any
/// other file, or one above kMaxMeshTriangles. Any thread; load time.
[[nodiscard]] std::vector<LooseTriangle> parse_stl(std::string_view bytes,
                                                   const std::string& location);

/// Parses a file of at most kMaxStlBytes, in a sandbox.
[[nodiscard]] std::vector<LooseTriangle> read_stl(const std::string& file,
                                                  int cpu_s = kReadCpuSeconds);

// The closed parts of a mesh: which way each faces, and what its user should know of the whole.

/// Turns the whole mesh outward, and then each part of it that is no hollow in another. A part is
/// judged after those that it lies in, for any order in the file. Returns the enclosed volume.
double turn_outward(ToolMesh& mesh);

/// What may be a slip in a mesh that encloses a solid, on one line; or empty: several shells, a
/// body that is round about another axis than the spindle's, or stands beside it. Load time.
[[nodiscard]] std::string mesh_note(const ToolMesh& mesh);

}  // namespace kerf
