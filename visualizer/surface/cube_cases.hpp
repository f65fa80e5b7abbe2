// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace kerf {

/// Marching cubes (Lorensen and Cline 1987): what the surface looks like within a cube, by which of
/// its eight corners are solid.
///
/// Corner c stands at (c & 1, c >> 1 & 1, c >> 2). Edge e = 4*axis + i runs along `axis` from the
/// i-th of the four corners that have 0 there, counted along axis+1, then axis+2 (mod 3).
///
/// The lists are worked out from two rules at compile time, so no table has to be trusted:
///  - what is drawn on a face follows from its four corners alone: each run of solid corners around
///    the face gets one line, so two solid corners across a diagonal stay apart. Cubes that share a
///    face agree on it, and the surface has no hole;
///  - no triangle's inner side lies on a face, where the neighbour might have the same one.
/// So every side belongs to exactly two triangles, whatever the volume holds.
inline constexpr std::size_t kCubeEdges = 12;
using CubeTriangle = std::array<std::uint8_t, 3>;  ///< edges; counter-clockwise from the air

/// The corner that an edge starts from; it ends at that | 1 << axis.
[[nodiscard]] constexpr unsigned edge_start(unsigned edge) noexcept {
  const unsigned axis = edge / 4;
  return (edge & 1) << (axis + 1) % 3 | (edge >> 1 & 1) << (axis + 2) % 3;
}

/// Bit c of `solid` is corner c; `solid` < 256.
[[nodiscard]] std::span<const CubeTriangle> cube_triangles(unsigned solid) noexcept;

}  // namespace kerf
