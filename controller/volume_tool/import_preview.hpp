// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "controller/volume/file/volume_io.hpp"
#include "controller/volume/volume_proposal.hpp"

namespace kerf {

/// A picture: rows from the top, 8 bits of red, green and blue.
struct RgbPicture {
  std::int32_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// The bytes of a PNG file (ISO 15948). Throws std::bad_alloc.
[[nodiscard]] std::string png_bytes(const RgbPicture& picture);

/// A sheet of four panels: slices across z, y and x through the middle of the kept part, the
/// surface seen from the front, above and the right of the source's frame.
///
/// In the slices grey is the value of the file, from air to the densest; kept voxels are tinted in
/// the colour of their material, removed ones are red. z is up, except in the first panel, where it
/// points into the picture. Load time; about a second.
[[nodiscard]] RgbPicture import_preview(const SourceVolume& source, const ProposedVolume& proposed);

/// The same of a volume with labels: each label has its own colour (shared/volume/material.hpp), in
/// the slices darker at low density; voxels without a label are grey.
[[nodiscard]] RgbPicture label_preview(const VolumeImage& image, Density iso);

}  // namespace kerf
