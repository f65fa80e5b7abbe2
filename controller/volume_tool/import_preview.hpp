// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/volume/file/volume_io.hpp"
#include "controller/volume/volume_proposal.hpp"
#include "controller/volume_tool/png_file.hpp"

namespace kerf {

/// A sheet of four panels: slices across z, y and x through the middle of what stays, the surface
/// seen from the front, above and the right of the source's frame.
///
/// In the slices grey is the file's value, from air to the densest; what stays is tinted in the
/// colour of its material, what was taken away is red. z is up, but in the first panel, where it
/// points into the picture. Load time; about a second.
[[nodiscard]] RgbPicture import_preview(const SourceVolume& source, const ProposedVolume& proposed);

/// The same of a volume with labels: each label has its own colour (label_colour.hpp), in the
/// slices darker where the density is low; what has none is grey.
[[nodiscard]] RgbPicture label_preview(const VolumeImage& image, Density iso);

}  // namespace kerf
