// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "controller/scene/scene.hpp"
#include "controller/volume/file/volume_image.hpp"

// The phantom: a lower molar, or a plain solid, on a grid. Its implicit fields are in
// phantom_fields.cpp, which has compile flags of its own.

namespace kerf {

/// Shape of the phantom, and its grid. The tooth is 19 mm long and stays in the
/// middle of the box.
struct PhantomSpec {
  std::string_view shape = kMolar;  ///< one of kPhantomShapes
  VoxelGrid grid{256, 256, 161};
  /// Edge of a voxel in mm; 0 takes the one at which the box keeps its physical size of
  /// 32 x 32 x 20 mm (0.125 for the default grid, 0.25 for 128 x 128 x 80).
  double spacing_mm = 0.0;
};

/// Labels of the phantom, and indices into the default material table.
inline constexpr Label kLabelEnamel = 1;
inline constexpr Label kLabelDentin = 2;
inline constexpr Label kLabelPulp = 3;
inline constexpr Label kLabelCaries = 4;  ///< a scene names its material

/// Densities of the phantom. Pulp is below the iso density of the tooth's scenes (0.45), so it does
/// not count as solid.
inline constexpr Density kPhantomEnamel = 65535;
inline constexpr Density kPhantomDentin = 40632;  // 0.62
inline constexpr Density kPhantomPulp = 18350;    // 0.28
inline constexpr Density kPhantomCaries =
    32768;  // 0.50: dentin that has lost a fifth of its mineral

/// A lower first molar: five cusps, two roots with three canals, crown at high z, buccal side at
/// +y, mesial side at +x. Density changes linearly over two voxels across each boundary; a voxel
/// has a label if it has density.
///
/// The carious molar's lesion begins in the fissure, goes through the enamel as a narrow track and
/// widens at the dentin, as occlusal caries does; a millimetre of dentin is left
/// above the pulp. The plain solids have no labels, and a density that changes over two voxels.
///
/// Uses + - * / and square roots only, so every machine makes the same bits. Throws LoadError for
/// a grid above the limits of `read_volume` or a spacing that is not positive.
[[nodiscard]] VolumeImage make_phantom(const PhantomSpec& spec = {});

/// Signed distance in mm from the phantom's outer surface, negative inside; (0, 0, 0) is the middle
/// of the box. First order: on the surface exact, with a slope of one; the error grows with the
/// square of the distance. Further than a few mm away only the sign and the magnitude hold.
[[nodiscard]] double phantom_signed_distance(double x_mm, double y_mm, double z_mm) noexcept;

}  // namespace kerf

namespace kerf::phantom {

/// A position in the phantom.
struct Point {
  double x, y, z;  ///< mm from the middle of the box: mesial, buccal, occlusal
};

/// The terms of the fields that depend on the height alone: half of the work, and the same for a
/// whole slice.
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

/// The dentin's field minus the outer one.
[[nodiscard]] double enamel_mm(Point p) noexcept;
/// Both fields, and both distances, are the same here, bit by bit.
[[nodiscard]] bool is_bare(Point p) noexcept;

inline constexpr double kSteepest = 2.5;

/// Distance in mm from the lesion of the carious molar, negative inside, if it ends in a tooth;
/// near its boundary right to a tenth.
[[nodiscard]] double lesion_distance(Point p) noexcept;

/// Signed distance in mm from a plain solid of kPhantomShapes, exact.
[[nodiscard]] double solid_distance(std::string_view shape, Point p) noexcept;

using Field = double (*)(Point, const Level&) noexcept;

/// field / |gradient|: the distance to the boundary to first order. `value` is `field(p)`.
[[nodiscard]] double distance(Field field, Point p, const Levels& levels, double value) noexcept;

}  // namespace kerf::phantom
