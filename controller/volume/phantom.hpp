// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "controller/scene/phantom_shapes.hpp"
#include "controller/volume/file/volume_image.hpp"

namespace kerf {

/// What the phantom is, and the grid it is sampled on. The tooth is 19 mm long and stays in the
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

/// Densities of the phantom. Pulp is soft: it lies below the iso density of 0.45 that suits the
/// tooth.
inline constexpr Density kPhantomEnamel = 65535;
inline constexpr Density kPhantomDentin = 40632;  // 0.62
inline constexpr Density kPhantomPulp = 18350;    // 0.28
inline constexpr Density kPhantomCaries =
    32768;  // 0.50: dentin that has lost a fifth of its mineral

/// A lower first molar: five cusps, two roots with three canals, crown at high z, buccal side at
/// +y, mesial side at +x. Density changes linearly over two voxels across each boundary; a voxel
/// has a label where it has density.
///
/// The carious molar's lesion begins in the fissure, goes through the enamel as a narrow track and
/// widens where the dentin begins, as occlusal caries does; a millimetre of dentin is left
/// above the pulp. The plain solids have no labels, and a density that changes over two voxels.
///
/// Uses + - * / and square roots only, so every machine makes the same bits. Throws SceneError for
/// a grid above the limits of `read_volume` or a spacing that is not positive.
[[nodiscard]] VolumeImage make_phantom(const PhantomSpec& spec = {});

/// Signed distance in mm from the phantom's outer surface, negative inside; (0, 0, 0) is the middle
/// of the box. First order: on the surface exact, with a slope of one; the error grows with the
/// square of the distance. Further than a few mm away only the sign and the order of size hold.
[[nodiscard]] double phantom_signed_distance(double x_mm, double y_mm, double z_mm) noexcept;

}  // namespace kerf
