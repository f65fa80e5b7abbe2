// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include <png.h>

#include "visualizer/gl/target.hpp"

namespace kerf::test {

/// 8-bit RGB, first row at the top.
struct RgbPicture {
  PictureSize size;
  std::vector<std::uint8_t> rgb;
};

/// None where there is no such PNG.
[[nodiscard]] inline std::optional<RgbPicture> read_png(const std::filesystem::path& file) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, file.c_str()) == 0) return std::nullopt;
  image.format = PNG_FORMAT_RGB;
  RgbPicture picture{{static_cast<int>(image.width), static_cast<int>(image.height)}, {}};
  picture.rgb.resize(PNG_IMAGE_SIZE(image));
  if (png_image_finish_read(&image, nullptr, picture.rgb.data(), 0, nullptr) == 0) {
    return std::nullopt;
  }
  return picture;
}

}  // namespace kerf::test
