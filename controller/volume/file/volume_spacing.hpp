// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/volume_io.hpp"

namespace kerf {

/// Sets the spacing of a volume, mm, whose grid is set: that of the file, and that of the options
/// along the axes of which the file has none. What was replaced or rounded is added to its note.
///
/// Throws LoadError that begins with `place` for a spacing of the options that contradicts the
/// file's, for one that is missing unless the options allow that, and for one that is no length. A
/// spacing of the options that overrides the file's contradicts nothing.
void take_spacing(const std::string& place, const ReadOptions& options,
                  const volume::UntrustedHeader& claim, SourceVolume& volume);

}  // namespace kerf
