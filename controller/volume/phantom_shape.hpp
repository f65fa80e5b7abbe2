// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace kerf::phantom {

/// A place in the phantom.
struct Point {
  double x, y, z;  ///< mm from the middle of the box: mesial, buccal, occlusal
};

/// What the fields need of a height alone: half of their work, and the same for a whole slice.
struct Level {
  explicit Level(double z) noexcept;
  struct Root {
    double z, half_x, half_y, axis_x;
  };
  struct Canal {
    double z, down, axis_x;  ///< `down`: 1 at the orifice, 0 at the end
  };
  double half_x, half_y, tilt_y, groove;  ///< of the crown
  Root mesial_root, distal_root;
  Canal mesial_canal, distal_canal;
};

/// The levels that `distance` reads.
struct Levels {
  explicit Levels(double z) noexcept;
  Level here, above, below;
};

/// Implicit fields of the phantom's boundaries, mm, negative inside. Each is zero on its boundary
/// and changes by at most `kSteepest` per mm; `distance` turns one into a distance near the
/// boundary. The dentin's field encloses the pulp, the outer field everything. `level` is of p.z.
[[nodiscard]] double outer_field(Point p, const Level& level) noexcept;
[[nodiscard]] double dentin_field(Point p, const Level& level) noexcept;
[[nodiscard]] double pulp_field(Point p, const Level& level) noexcept;

/// What the dentin's field has more than the outer one.
[[nodiscard]] double enamel_mm(Point p) noexcept;
/// Both fields, and both distances, are the same here, bit by bit.
[[nodiscard]] bool is_bare(Point p) noexcept;

inline constexpr double kSteepest = 2.5;

/// Distance in mm from the lesion of the carious molar, negative inside, where it ends in a tooth;
/// near its boundary right to a tenth.
[[nodiscard]] double lesion_distance(Point p) noexcept;

/// Signed distance in mm from a plain solid of kPhantomShapes, exact.
[[nodiscard]] double solid_distance(std::string_view shape, Point p) noexcept;

using Field = double (*)(Point, const Level&) noexcept;

/// field / |gradient|: the distance to the boundary to first order. `value` is `field(p)`.
[[nodiscard]] double distance(Field field, Point p, const Levels& levels, double value) noexcept;

}  // namespace kerf::phantom
