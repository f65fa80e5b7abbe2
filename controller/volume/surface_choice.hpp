// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "controller/volume/volume_density.hpp"

namespace kerf {

/// Hounsfield's scale (DICOM PS3.3 C.11.1.1.2): -1000 is air and 0 is water, by definition.
inline constexpr double kAirHu = -1000, kWaterHu = 0;

/// Which threshold parts what is to be felt from what is around it, in values of the file.
struct SurfaceChoice {
  bool hounsfield = false;     ///< as air has it, -1000 is there, and no more than 16 bits hold
  double skin = 0;             ///< Otsu's threshold of all: air below
  std::optional<double> hard;  ///< that of what is above: a second, denser class; none: one class
  bool covered = false;        ///< the denser class lies below a skin of the other
  double iso = 0;              ///< `hard` where it is covered, else `skin`
};

/// Chooses from the histogram, and by where the classes lie:
///
/// - Two thresholds by Otsu's rule, each parting what the one before left above it.
/// - In HU the second parts what is between water and 1500 HU, and counts where it is above all
///   soft tissue and blood; then it is bone.
/// - Without a scale: bone is hidden below skin, enamel lies bare. So the denser class is taken
///   where air is hardly ever near its surface.
///
/// `image`: the whole range of the file, `range`, as densities. Load time.
[[nodiscard]] SurfaceChoice choose_surface(const VolumeImage& image, Window range);

}  // namespace kerf
