// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/volume/file/foreign_volume.hpp"

namespace kerf::volume {

/// One volume from the frames of DICOM files: of one file, or of those of a folder, among which
/// other files may be. In the sandbox, as `read_foreign_volume`, which calls it. `path`: the file
/// or folder, for messages.
///
/// Frames are put in order by their positions along the normal; without any position by
/// SliceLocation, else by number, which the note names. Refused by name: no unique series, a gap,
/// two frames at one position, slices that are shifted sideways, a slice that cannot be read.
void read_dicom(const std::filesystem::path& path, const std::vector<std::filesystem::path>& files,
                const std::string& series, SandboxReader& sandbox, const MemoryRequest& offer);

}  // namespace kerf::volume
