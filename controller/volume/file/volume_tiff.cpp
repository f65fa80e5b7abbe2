// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <string>

#include "controller/scene/scene_error.hpp"
#include "controller/volume/file/volume_header.hpp"
#include "controller/volume/file/volume_limits.hpp"

namespace kerf {
namespace fs = std::filesystem;
namespace {

/// Numbers of a TIFF file in its byte order.
class TiffFile {
 public:
  explicit TiffFile(const fs::path& path) : path_(path), in_(path, std::ios::binary) {
    std::array<char, 2> order{};
    in_.read(order.data(), order.size());
    big_endian_ = order[0] == 'M';
    const bool known = order[0] == order[1] && (order[0] == 'I' || big_endian_);
    const std::uint64_t version = known ? number(2, 2) : 0;
    constexpr std::uint64_t kClassic = 42, kBig = 43;
    if (version != kClassic && version != kBig) {
      throw SceneError(path.string() + ": no TIFF header; is it another format?");
    }
    wide_ = version == kBig;
  }

  /// The bytes of an offset.
  [[nodiscard]] std::size_t wide() const { return wide_ ? 8 : 4; }
  [[nodiscard]] std::uint64_t first_page() { return number(wide_ ? 8 : 4, wide()); }
  [[nodiscard]] std::uint64_t page_after(std::uint64_t page) {
    const std::size_t count = wide_ ? 8 : 2, entry = wide_ ? 20 : 12;
    return number(page + count + entry * number(page, count), wide());
  }

 private:
  [[nodiscard]] std::uint64_t number(std::uint64_t at, std::size_t bytes) {
    std::array<unsigned char, 8> raw{};
    in_.seekg(static_cast<std::streamoff>(std::min<std::uint64_t>(at, INT64_MAX)));
    in_.read(reinterpret_cast<char*>(raw.data()), static_cast<std::streamsize>(bytes));
    if (!in_) {
      throw SceneError(path_.string() +
                       ": a page begins behind its end; the file is cut off, copy " + "it again");
    }
    if (big_endian_) std::reverse(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(bytes));
    std::uint64_t value = 0;
    for (std::size_t i = bytes; i-- > 0;) value = value << 8 | raw[i];
    return value;
  }

  const fs::path& path_;
  std::ifstream in_;
  bool big_endian_ = false, wide_ = false;
};

}  // namespace

VolumeHeader read_tiff_header(const fs::path& path) {
  TiffFile file(path);
  std::int64_t pages = 0;
  for (std::uint64_t page = file.first_page(); page != 0; page = file.page_after(page)) {
    if (++pages > kMaxVoxelsPerAxis) check_grid(path.string(), 1, 1, pages);
  }
  VolumeHeader header;
  header.has_spacing = false;  // none between its pages
  return header;
}

}  // namespace kerf
