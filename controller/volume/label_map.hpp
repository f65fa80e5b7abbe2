// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "controller/volume/file/volume_io.hpp"

namespace kerf {

/// Where a file holds labels and nothing else, `image`, its densities, becomes a solid of them:
/// each label full density. Tells whether. Labels are whole numbers up to 255 of which 0 and at
/// least two others occur, in blocks with nothing between them, as no scan has them. Throws
/// SceneError, which begins with `place`, where a label is too high for a scene to have a material
/// for it. Load time.
[[nodiscard]] bool take_label_map(const SourceVolume& source, VolumeImage& image,
                                  const std::string& place);

}  // namespace kerf
