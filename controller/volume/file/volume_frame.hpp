// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/volume_io.hpp"

// What the options complete or replace in the frame of a file: the size and the axes of its voxels.

namespace kerf {

/// Sets the spacing of a volume, mm, whose grid is set: that of the file, and that of the options
/// along the axes of which the file has none. What was replaced or rounded is added to its note.
///
/// Throws LoadError that begins with `location` for a spacing of the options that contradicts the
/// file's, for one that is missing unless the options allow that, and for one that is no length. A
/// spacing of the options that overrides the file's contradicts nothing.
void take_spacing(const std::string& location, const ReadOptions& options,
                  const volume::UntrustedHeader& claim, SourceVolume& volume);

/// Sets the axes of a file that names none from `letters`; without letters returns, on one line,
/// which usual ones are taken: if they are wrong the volume is turned or mirrored. Throws LoadError
/// for letters that are none, and for a file that has axes of its own.
[[nodiscard]] std::string take_axes(const std::string& location, const std::string& letters,
                                    volume::UntrustedHeader& claim);

}  // namespace kerf
