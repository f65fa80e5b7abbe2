// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "visualizer/view/pixel_rect.hpp"

namespace kerf {

/// `rgb` as in RenderTarget::read_rgb, 8-bit sRGB PNG, as one new file. Throws FileError.
void write_png(const std::filesystem::path& path, PictureSize size,
               std::span<const std::uint8_t> rgb);

/// Makes the folder, and its parents, where it is missing. Throws VisualizerError.
void make_folder(const std::filesystem::path& folder);

}  // namespace kerf
