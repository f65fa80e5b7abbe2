// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <doctest/doctest.h>

#include "lab/rig/contact_rig.hpp"
#include "lab/rig/tool_meshes.hpp"

using namespace kerf;
using namespace kerf::extremes;

namespace {

using N = FixedNumbers;

/// How far above the ideal place a tool comes to rest on a flat, for some random turns: the largest
/// difference between two tools of the same body, and the largest offset of the second.
struct Rests {
  double apart = 0, off = 0;
};

Rests rest_on_flats(const SceneTool& shape, const SceneTool& mesh) {
  constexpr VoxelGrid kGrid{40, 40, 40};
  const SampledTool shape_samples(shape), mesh_samples(mesh);
  Dice dice(5);
  Rests rests;
  for (int k = 0; k < 8; ++k) {
    const Frame frame(dice, {19, 19, 19});
    const Point axis = dice.direction(), across = dice.across(axis), third = cross(across, axis);
    RotationRows<N> rows;
    for (std::size_t i = 0; i < 3; ++i) {
      rows[i] = {N::Unit(across[i]), N::Unit(axis[i]), N::Unit(third[i])};
    }
    const Orientation<N> turn = orientation_of<N>(rows);
    double support = 0;
    for (const Point& p : mesh.mesh.points_mm) {
      const Point at = p[0] * across + p[1] * axis + p[2] * third;
      support = std::max(support, -dot(at, frame.up));
    }
    const Body flat = blurred(kGrid, [&](Point p) { return frame.of(p)[1] + support; });
    const auto height = [&](const SampledTool& tool) {
      return frame.of(rest_of<N>(tool, flat, frame.place, frame.up, turn, 16))[1];
    };
    const double of_mesh = height(mesh_samples);
    rests.apart = std::max(rests.apart, std::abs(of_mesh - height(shape_samples)));
    rests.off = std::max(rests.off, std::abs(of_mesh));
  }
  return rests;
}

}  // namespace

TEST_CASE("a cylinder as a mesh of 48 sides rests where the shape does, in any pose") {
  const Rests rests =
      rest_on_flats(tool_of_units("cylinder", 5, 16), mesh_of_units("mesh", prism(5, 16, 48)));
  CHECK(rests.off < 0.075);
  CHECK(rests.apart < 0.075);
}

TEST_CASE("a square bar, which no shape is, rests within the limits of the shapes") {
  const SceneTool bar = mesh_of_units("mesh", prism(6, 16, 4));
  CHECK(rest_on_flats(bar, bar).off < 0.075);
}
