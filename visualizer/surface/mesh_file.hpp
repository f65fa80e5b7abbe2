// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "visualizer/surface/closed_mesh.hpp"

namespace kerf {

/// The mesh as the bytes of a binary STL file: triangles with the normal of their plane. STL has no
/// colours and names no unit; ours are mm, as most readers take it.
[[nodiscard]] std::string stl_bytes(const ClosedMesh& mesh);

/// The mesh as the bytes of a binary little-endian PLY file: position, normal and sRGB colour of
/// each vertex, and triangles.
[[nodiscard]] std::string ply_bytes(const ClosedMesh& mesh);

}  // namespace kerf
