// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace kerf::phantom {

/// A place in the phantom.
struct Point {
  double x, y, z;  ///< mm from the middle of the box: mesial, buccal, occlusal
};

/// Implicit fields of the phantom's boundaries, mm, negative inside. Each is zero on its boundary
/// and changes by at most `kSteepest` per mm; `distance` turns one into a distance near the
/// boundary. The dentin's field encloses the pulp, the outer field everything.
[[nodiscard]] double outer_field(Point p) noexcept;
[[nodiscard]] double dentin_field(Point p) noexcept;
[[nodiscard]] double pulp_field(Point p) noexcept;

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

using Field = double (*)(Point) noexcept;

/// field / |gradient|: the distance to the boundary to first order. `value` is `field(p)`.
[[nodiscard]] double distance(Field field, Point p, double value) noexcept;

}  // namespace kerf::phantom
