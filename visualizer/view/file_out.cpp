// SPDX-License-Identifier: Apache-2.0
#include "visualizer/view/file_out.hpp"

#include <string>
#include <system_error>

#include <png.h>

#include "shared/posix/new_file.hpp"
#include "visualizer/error.hpp"

namespace kerf {

void write_png(const std::filesystem::path& path, PictureSize size,
               std::span<const std::uint8_t> rgb) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(size.width);
  image.height = static_cast<png_uint_32>(size.height);
  image.format = PNG_FORMAT_RGB;
  std::string bytes(PNG_IMAGE_PNG_SIZE_MAX(image), '\0');
  png_alloc_size_t length = bytes.size();
  if (png_image_write_to_memory(&image, bytes.data(), &length, 0, rgb.data(), 0, nullptr) == 0) {
    throw VisualizerError(path.string() + ": " + image.message);
  }
  bytes.resize(length);
  write_new_file(path, bytes);
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw VisualizerError(folder.string() + ": " + error.message() +
                          "; name a place that can be written");
  }
}

}  // namespace kerf
