// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <bit>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <png.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/header_fields.hpp"

namespace kerf::volume {
namespace {

/// A PNG that is read, and the reason why libpng gave up.
struct Png {
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file;
  std::array<char, 100> reason{};
  png_structp read = nullptr;
  png_infop info = nullptr;

  explicit Png(const std::filesystem::path& path)
      : file(std::fopen(path.c_str(), "rb"), std::fclose) {
    read = png_create_read_struct(PNG_LIBPNG_VER_STRING, &reason, fail, ignore);
    if (read != nullptr) info = png_create_info_struct(read);
    if (info == nullptr) throw std::bad_alloc();
    if (!file) kerf::refuse(path.string(), ": cannot be opened; check its permissions");
  }
  ~Png() { png_destroy_read_struct(&read, &info, nullptr); }
  Png(const Png&) = delete;
  Png& operator=(const Png&) = delete;

  /// Calls libpng, which jumps out of `step` if it fails: no object there may need its destructor.
  template <class Step>
  [[nodiscard]] bool succeeds(const Step& step) {
    if (setjmp(png_jmpbuf(read)) != 0) return false;
    step();
    return true;
  }

 private:
  static void fail(png_structp png, png_const_charp why) {
    auto& reason = *static_cast<std::array<char, 100>*>(png_get_error_ptr(png));
    std::snprintf(reason.data(), reason.size(), "%s", why);
    png_longjmp(png, 1);
  }
  static void ignore(png_structp, png_const_charp) {}
};

}  // namespace

void read_png_slice(const std::filesystem::path& path, const SliceMemory& memory) {
  Png png(path);
  const bool begun = png.succeeds([&] {
    png_init_io(png.read, png.file.get());
    png_read_info(png.read, png.info);
  });
  if (!begun) refuse_unreadable(path, png.reason.data());
  const int bits = png_get_bit_depth(png.read, png.info),
            colour = png_get_color_type(png.read, png.info);
  if (colour != PNG_COLOR_TYPE_GRAY || png_get_valid(png.read, png.info, PNG_INFO_tRNS) != 0) {
    kerf::refuse(path.string(),
                 std::string(": pixels of ") +
                     (colour == PNG_COLOR_TYPE_PALETTE       ? "a palette"
                      : (colour & PNG_COLOR_MASK_COLOR) == 0 ? "grey with transparency"
                                                             : "colours") +
                     "; save it as one grey value per pixel");
  }
  if (bits < 8) {
    kerf::refuse(path.string(), ": values of " + std::to_string(bits) +
                                    " bits; save it with 8 or 16 bits per pixel");
  }
  Slices found;
  found.size = {png_get_image_width(png.read, png.info), png_get_image_height(png.read, png.info),
                1};
  found.type = bits == 16 ? VoxelType::uint16 : VoxelType::uint8;
  check_grid(path.string(), found.size[0], found.size[1], 1);
  const std::span<std::byte> to = memory(found);
  if (to.empty()) return;
  const std::size_t row = static_cast<std::size_t>(found.size[0]) * bytes_of(found.type);
  std::vector<png_bytep> rows;
  for (std::size_t at = 0; at < to.size(); at += row) {
    rows.push_back(reinterpret_cast<png_bytep>(&to[at]));
  }
  const bool whole = png.succeeds([&] {
    if (bits == 16 && std::endian::native == std::endian::little) png_set_swap(png.read);
    png_read_image(png.read, rows.data());
    png_read_end(png.read, nullptr);
  });
  if (!whole) refuse_unreadable(path, png.reason.data());
}

}  // namespace kerf::volume
