// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "controller/tool/surface_sample.hpp"
#include "controller/tool/tool_mesh.hpp"

namespace kerf {

/// Area of all triangles.
[[nodiscard]] double surface_mm2(const ToolMesh& mesh);

/// How evenly samples of a mesh lie: so many dots a sample stand for the surface, and so many
/// rounds of the relaxation move the samples.
struct Relaxation {
  std::size_t dots;
  int rounds;
};
inline constexpr Relaxation kEven{
    32, 24};  ///< later rounds move them by less than 1 % of their distance
inline constexpr Relaxation kNearlyEven{12, 8};  ///< takes a sixth of the time

/// Some `count` samples of a mesh, each with the same area to itself: those of its rims and points,
/// and between them the others where Lloyd's relaxation puts them, the middles of what is nearest
/// to each. Faces that look away from each other do not see each other, so that a thin blade has
/// samples on both of its sides. The same mesh gives the same samples. Load time: 0.1 s for 1000
/// that are kEven.
[[nodiscard]] std::vector<SurfaceSample> mesh_surface_samples(const ToolMesh& mesh,
                                                              std::size_t count,
                                                              Relaxation relaxation = kEven);

}  // namespace kerf
