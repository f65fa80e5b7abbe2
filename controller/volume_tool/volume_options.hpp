// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "controller/volume/volume_density.hpp"
#include "shared/posix/new_files.hpp"

namespace kerf {

/// The texts of options as values. Each throws SceneError, one line that names the option.
[[nodiscard]] std::array<double, 3> spacing_from(const std::string& text);  ///< "0.2" or "1,1,2"
[[nodiscard]] Window window_from(const std::string& text);                  ///< "-200,1500"
/// "256x256x161"
[[nodiscard]] VoxelGrid grid_from(const std::string& option, const std::string& text);

/// What a command reads of a volume, which its outputs leave alone: the file or folder, and labels.
[[nodiscard]] std::vector<std::filesystem::path> files_read(const std::filesystem::path& volume);

/// Refuses a file that is there, unless `force`.
void refuse_replacing(const std::filesystem::path& path, bool force);

/// Gives the files their names; refuses what is there by now, unless `force`.
void commit(NewFiles& files, bool force);

}  // namespace kerf
