// SPDX-License-Identifier: Apache-2.0
// Binary headers: NIfTI, then TIFF.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include <zlib.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/file_headers.hpp"
#include "controller/volume/file/volume_image.hpp"

namespace kerf {
namespace fs = std::filesystem;
namespace {

using volume::GzFile;

/// Bytes of a header in the byte order of the file.
class HeaderBytes {
 public:
  HeaderBytes(const std::vector<unsigned char>& bytes, bool swapped)
      : bytes_(bytes), swapped_(swapped) {}

  template <class T>
  [[nodiscard]] T get(std::size_t offset) const noexcept {
    std::array<unsigned char, sizeof(T)> raw{};
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), sizeof(T), raw.begin());
    if (swapped_) std::reverse(raw.begin(), raw.end());
    return std::bit_cast<T>(raw);
  }

 private:
  const std::vector<unsigned char>& bytes_;
  bool swapped_;
};

/// The header fields that are used here. Offsets from nifti1.h and nifti2.h.
struct Nifti {
  bool swapped = false;
  std::array<std::int64_t, 8> dim{};  ///< dim[0] is the number of axes
  std::array<double, 3> pixdim{};
  std::int16_t datatype = 0;
  std::int16_t bits = 0;
  std::int64_t data_offset = 0;
};

constexpr std::int32_t kSize1 = 348;
constexpr std::int32_t kSize2 = 540;
constexpr std::int16_t kFloat32 = 16;
constexpr std::int16_t kFloat64 = 64;

Nifti parse(const std::vector<unsigned char>& bytes, bool second, bool swapped) {
  const HeaderBytes in(bytes, swapped);
  Nifti h;
  h.swapped = swapped;
  for (std::size_t i = 0; i < 8; ++i) {
    h.dim[i] = second ? in.get<std::int64_t>(16 + 8 * i) : in.get<std::int16_t>(40 + 2 * i);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    h.pixdim[i] =
        second ? in.get<double>(112 + 8 * i) : static_cast<double>(in.get<float>(80 + 4 * i));
  }
  h.datatype = in.get<std::int16_t>(second ? 12 : 70);
  h.bits = in.get<std::int16_t>(second ? 14 : 72);
  if (second) {
    h.data_offset = in.get<std::int64_t>(168);
  } else {
    const double offset = in.get<float>(108);
    h.data_offset = offset >= 0.0 && offset < 1e9 ? static_cast<std::int64_t>(offset) : -1;
  }
  return h;
}

Nifti read_header(const fs::path& path, gzFile file) {
  std::vector<unsigned char> bytes(kSize2, 0);
  const int got = gzread(file, bytes.data(), static_cast<unsigned>(kSize2));
  for (const bool second : {false, true}) {
    const std::int32_t size = second ? kSize2 : kSize1;
    for (const bool swapped : {false, true}) {
      if (got >= size && HeaderBytes(bytes, swapped).get<std::int32_t>(0) == size) {
        return parse(bytes, second, swapped);
      }
    }
  }
  throw LoadError(path.string() + ": no NIfTI header; is it another format, or cut off?");
}

/// The types that hold one number or a colour; the reader judges colours. Others make the library
/// print and fail.
void check_type(const fs::path& path, const Nifti& h) {
  struct Type {
    std::int16_t code, bits;
  };
  constexpr std::array<Type, 12> kTypes{{{2, 8},
                                         {4, 16},
                                         {8, 32},
                                         {kFloat32, 32},
                                         {kFloat64, 64},
                                         {128, 24},
                                         {256, 8},
                                         {512, 16},
                                         {768, 32},
                                         {1024, 64},
                                         {1280, 64},
                                         {2304, 32}}};
  const bool known = std::any_of(kTypes.begin(), kTypes.end(), [&](const Type& type) {
    return type.code == h.datatype && type.bits == h.bits;
  });
  if (known) return;
  throw LoadError(path.string() + ": type " + std::to_string(h.datatype) + " of " +
                  std::to_string(h.bits) +
                  " bits per voxel; save it as integers of 8..32 bits or as floats");
}

template <class T>
bool finite_at(const unsigned char* at, bool swapped) noexcept {
  std::array<unsigned char, sizeof(T)> raw{};
  std::copy_n(at, sizeof(T), raw.begin());
  if (swapped) std::reverse(raw.begin(), raw.end());
  return std::isfinite(std::bit_cast<T>(raw));
}

/// Reads all voxels once, in pieces, and refuses missing ones and those that are no numbers.
void walk_data(const fs::path& path, gzFile file, const Nifti& h, std::uint64_t expected) {
  constexpr std::size_t kPiece = std::size_t{1} << 20;  // a multiple of every voxel size
  const std::size_t step = static_cast<std::size_t>(h.bits) / 8;
  std::vector<unsigned char> piece(kPiece);
  std::uint64_t held = 0;
  std::uint64_t bad = 0;
  std::uint64_t first_bad = 0;
  while (held < expected) {
    const auto want = static_cast<unsigned>(std::min<std::uint64_t>(kPiece, expected - held));
    const int got = gzread(file, piece.data(), want);
    if (got <= 0) refuse_truncated(path.string(), held, expected);
    if (h.datatype == kFloat32 || h.datatype == kFloat64) {
      const auto count = static_cast<std::size_t>(got) / step;
      for (std::size_t i = 0; i < count; ++i) {
        const unsigned char* at = &piece[i * step];
        const bool good = h.datatype == kFloat32 ? finite_at<float>(at, h.swapped)
                                                 : finite_at<double>(at, h.swapped);
        if (good) continue;
        if (bad++ == 0) first_bad = held / step + i;
      }
    }
    held += static_cast<std::uint64_t>(got);
  }
  if (bad != 0) {
    refuse_not_finite(path, bad, first_bad, static_cast<std::uint64_t>(h.dim[1]),
                      static_cast<std::uint64_t>(h.dim[2]));
  }
}

}  // namespace

VolumeHeader read_nifti_header(const fs::path& path) {
  const GzFile file(gzopen(path.c_str(), "rb"));
  if (!file) throw LoadError(path.string() + ": cannot be opened; check its permissions");
  const Nifti h = read_header(path, file.get());
  if (h.dim[0] != 3 && !(h.dim[0] > 3 && h.dim[0] <= 7)) {
    throw LoadError(path.string() + ": " + std::to_string(h.dim[0]) +
                    " axes; kerf needs a volume of three");
  }
  check_grid(path.string(), h.dim[1], h.dim[2], h.dim[3]);
  std::uint64_t expected = static_cast<std::uint64_t>(h.dim[1] * h.dim[2] * h.dim[3]);
  for (std::int64_t axis = 4; axis <= h.dim[0]; ++axis) {
    if (h.dim[static_cast<std::size_t>(axis)] > 1) {
      throw LoadError(path.string() + ": " + std::to_string(h.dim[static_cast<std::size_t>(axis)]) +
                      " volumes along axis " + std::to_string(axis) +
                      "; save one of them to a file of its own");
    }
  }
  check_type(path, h);
  expected *= static_cast<std::uint64_t>(h.bits) / 8;
  if (h.data_offset < 0 || gzseek(file.get(), h.data_offset, SEEK_SET) != h.data_offset) {
    refuse_truncated(path.string(), 0, expected);
  }
  walk_data(path, file.get(), h, expected);
  VolumeHeader header;
  const auto is_length = [](double edge) { return std::isfinite(edge) && edge != 0.0; };
  header.spacing_known = std::ranges::all_of(h.pixdim, is_length) ? kAllAxes : 0;
  return header;
}

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
      throw LoadError(path.string() + ": no TIFF header; is it another format?");
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
      throw LoadError(path_.string() +
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
  header.spacing_known = 0;  // a TIFF has none between pages
  return header;
}

}  // namespace kerf
