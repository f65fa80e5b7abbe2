// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "controller/volume/volume_density.hpp"

namespace kerf {

/// The texts of options as values. Each throws SceneError, one line that names the option.
[[nodiscard]] std::array<double, 3> spacing_from(const std::string& text);  ///< "0.2" or "1,1,2"
[[nodiscard]] Window window_from(const std::string& text);                  ///< "-200,1500"
/// "256x256x161"
[[nodiscard]] VoxelGrid grid_from(const std::string& option, const std::string& text);

/// Refuses a file that is there, unless `force`.
void refuse_replacing(const std::filesystem::path& path, bool force);

}  // namespace kerf
