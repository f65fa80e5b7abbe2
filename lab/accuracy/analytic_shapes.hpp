// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "shared/numeric/vec.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf::accuracy {

using Point = WorldVec<double>;  ///< mm

/// Of length 1; `v` is not zero.
[[nodiscard]] inline Point unit(Point v) {
  return v * (1 / norm(v));
}

/// A solid by its signed distance: negative inside, of slope one near the face.
struct Layer {
  std::function<double(Point)> distance_mm;
  double density;  ///< 0..1, added to that of the other layers
};

/// What an ideal scanner would see. The first layer encloses the others.
struct Shape {
  std::string name;
  std::vector<Layer> layers;

  [[nodiscard]] double distance_mm(Point at) const { return layers.front().distance_mm(at); }
  /// Outward normal of the outer face nearest to `at`.
  [[nodiscard]] Point normal(Point at) const;
  /// 0..1; each face is a ramp of `edge_mm` across, clip(0.5 - distance / edge, 0, 1).
  [[nodiscard]] double density(Point at, double edge_mm) const;
};

[[nodiscard]] Shape plane(Point normal, double offset_mm);  ///< solid below; `normal` of any length
[[nodiscard]] Shape ball(Point centre, double radius_mm);
[[nodiscard]] Shape torus(Point axis, double ring_mm, double tube_mm);
[[nodiscard]] Shape thin_plate(Point normal, double thickness_mm);
[[nodiscard]] Shape crease();  ///< a groove of 90 degrees between two tilted flats
/// Enamel of full density around a dentin of 0.6.
[[nodiscard]] Shape layered_ball(Point centre, double radius_mm, double enamel_mm);

/// A shape in voxels, antialiased over one voxel edge. The place (0, 0, 0) mm is the centre of the
/// voxel with index n / 2 along each axis.
struct AnalyticVolume {
  VoxelGrid grid;
  double voxel_mm;
  std::vector<Density> density;

  [[nodiscard]] VoxelVec<double> voxel_from_mm(Point at) const noexcept;
  [[nodiscard]] Point mm_from_voxel(VoxelVec<double> at) const noexcept;
};

/// A cube of `side_mm` around (0, 0, 0).
[[nodiscard]] AnalyticVolume volume_of(const Shape& shape, double side_mm, double voxel_mm);

/// The `i`-th of `count` directions that cover the sphere evenly (Fibonacci lattice).
[[nodiscard]] Point spread_direction(std::size_t i, std::size_t count);
/// The `i`-th place of an even cover of the cube from -1 to 1 (Halton sequence, bases 2, 3, 5).
[[nodiscard]] Point spread_place(std::size_t i);

}  // namespace kerf::accuracy
