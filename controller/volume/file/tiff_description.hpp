// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "controller/volume/file/slices.hpp"

namespace kerf::volume {

/// Pixels per unit of length along rows and columns, 0 if unknown; the unit as TIFF counts them.
struct TiffResolution {
  double x = 0, y = 0;
  unsigned unit = 0;
};

/// Sets spacing and scaling of a TIFF's slices as ImageJ or OME-XML name them in `text`, the
/// description of the first page. Throws LoadError if ImageJ, OME-XML or tifffile has other axes
/// than rows, columns and these slices, or planes in another order. In the sandbox.
void describe_slices(const std::filesystem::path& path, const std::string& text,
                     const TiffResolution& resolution, Slices& slices);

}  // namespace kerf::volume
