// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "controller/plan/method/tool_method.hpp"

namespace kerf {

// What the methods ask of each other: when a tool cannot be aligned, and what those that take it in
// any pose can hold.

/// Why the method `aligned` cannot serve; empty where it can.
[[nodiscard]] std::string why_not_aligned(const ToolCase& in);

/// To a person whose tool was not aligned.
inline constexpr const char* kAdviceToAlign = "a round or unturned tool on the volume's lattice";

/// The bounds that keep fixed-point sums within their integers: how far samples lie from the tool's
/// centre, and how many share a voxel or a plane. Throw SceneError.
void check_reach(const ToolCase& in);
void check_splat(const ToolCase& in);

// Operations that they count alike.
inline constexpr std::uint64_t kPlaceOperations = 9;  ///< multiply-adds: three a component
inline constexpr std::uint64_t kCellCorners = 8;

[[nodiscard]] constexpr std::uint64_t count(std::int32_t n) noexcept {
  return static_cast<std::uint64_t>(n);
}
[[nodiscard]] constexpr std::uint64_t voxels_of(VoxelIndex edges) noexcept {
  return count(edges.x) * count(edges.y) * count(edges.z);
}
/// Rows of a box's overlap.
[[nodiscard]] constexpr std::uint64_t rows_of(VoxelIndex size) noexcept {
  return (count(size.y) + 1) * (count(size.z) + 1);
}

}  // namespace kerf
