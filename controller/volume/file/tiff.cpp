// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cstdarg>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include <tiffio.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/header_fields.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;
namespace {

/// An open TIFF and the last complaint of libtiff about it.
class Tiff {
 public:
  explicit Tiff(const fs::path& path) : path_(path), bytes_(path, std::ios::binary) {
    const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> options(
        TIFFOpenOptionsAlloc(), TIFFOpenOptionsFree);
    TIFFOpenOptionsSetErrorHandlerExtR(options.get(), keep, &error_);
    TIFFOpenOptionsSetWarningHandlerExtR(options.get(), keep, &warning_);
    file_ = TIFFOpenExt(path.c_str(), "rm", options.get());  // m: not mapped
    if (file_ == nullptr) complain();
  }
  ~Tiff() { TIFFClose(file_); }
  Tiff(const Tiff&) = delete;
  Tiff& operator=(const Tiff&) = delete;

  /// The next page, by file order; false after the last. Refuses a chain of pages that is broken.
  bool next() {
    const bool more = page_++ == 0 || TIFFReadDirectory(file_) != 0;
    if (error_[0] != '\0' || (!more && TIFFLastDirectory(file_) == 0)) complain();
    return more;
  }

  /// Whether the page has the SubfileType of TIFF 5.0 for a reduced copy, which libtiff drops. Also
  /// refuses a file that is cut off in the offset of the next page, which libtiff takes for none.
  [[nodiscard]] bool is_old_copy() {
    constexpr std::uint64_t kBigTiff = 43;
    const bool big = number_at(2, 2) == kBigTiff;
    const std::size_t head = big ? 8 : 2, entry = big ? 20 : 12, offset = big ? 8 : 4;
    std::uint64_t at = TIFFCurrentDirOffset(file_);
    bool copy = false;
    for (std::uint64_t left = number_at(std::exchange(at, at + head), head); left > 0; --left) {
      copy = copy || (number_at(at, 2) == TIFFTAG_OSUBFILETYPE &&
                      number_at(at + entry - offset, 2) == OFILETYPE_REDUCEDIMAGE);
      at += entry;
    }
    static_cast<void>(number_at(at, offset));
    return copy;
  }

  template <class T>
  [[nodiscard]] T number(std::uint32_t tag, T otherwise = {}) const {
    T value{};
    return TIFFGetFieldDefaulted(file_, tag, &value) == 1 ? value : otherwise;
  }
  [[nodiscard]] std::string text(std::uint32_t tag) const {
    const char* value = nullptr;
    return TIFFGetField(file_, tag, &value) == 1 && value != nullptr ? value : "";
  }
  /// PageNumber of TIFF 6.0, section 12; -1 if there is none.
  [[nodiscard]] int page_number() const {
    std::uint16_t number = 0, total = 0;
    return TIFFGetField(file_, TIFFTAG_PAGENUMBER, &number, &total) == 1 ? number : -1;
  }
  [[nodiscard]] bool has_pages_within() const {
    std::uint16_t count = 0;
    const std::uint64_t* offsets = nullptr;
    return TIFFGetField(file_, TIFFTAG_SUBIFD, &count, &offsets) == 1 && count > 0;
  }

  /// Reads the page of `width` x `height` numbers of `each` bytes.
  void read(std::size_t width, std::size_t height, std::size_t each, std::span<std::byte> to) {
    warning_[0] = '\0';
    if (TIFFIsTiled(file_) != 0) {
      read_tiles(width, height, each, to);
    } else {
      const std::size_t rows = number<std::uint32_t>(TIFFTAG_ROWSPERSTRIP, 0);
      if (rows == 0) complain();
      for (std::size_t y = 0, strip = 0; y < height; y += rows, ++strip) {
        const std::size_t bytes = std::min(rows, height - y) * width * each;
        decode(bytes, TIFFReadEncodedStrip(file_, static_cast<std::uint32_t>(strip), to.data(),
                                           static_cast<tmsize_t>(bytes)));
        to = to.subspan(bytes);
      }
    }
  }

  [[noreturn]] void refuse_page(const std::string& what, const std::string& way_out) const {
    kerf::refuse(path_.string(), ": page " + std::to_string(page_) + ": " + what + "; " + way_out);
  }

 private:
  using Message = std::array<char, 200>;

  static int keep(TIFF*, void* message, const char*, const char* format, va_list list) {
    std::vsnprintf(static_cast<Message*>(message)->data(), Message{}.size(), format, list);
    return 1;
  }

  std::uint64_t number_at(std::uint64_t at, std::size_t count) {
    std::array<unsigned char, 8> raw{};
    bytes_.seekg(static_cast<std::streamoff>(at));
    if (!bytes_.read(reinterpret_cast<char*>(raw.data()), static_cast<std::streamsize>(count))) {
      complain();
    }
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < count; ++i) {
      value = value << 8 | raw[TIFFIsBigEndian(file_) != 0 ? i : count - 1 - i];
    }
    return value;
  }

  [[noreturn]] void complain() const {
    const char* const reason = error_[0] != '\0'     ? error_.data()
                               : warning_[0] != '\0' ? warning_.data()
                                                     : "its pages or pixels do not end";
    refuse_unreadable(path_, reason);
  }

  /// Refuses a strip or tile that is too short, or that a decoder warns about: some decoders fill
  /// in missing data and only warn.
  void decode(std::size_t wanted, tmsize_t got) const {
    if (got != static_cast<tmsize_t>(wanted) || warning_[0] != '\0') complain();
  }

  void read_tiles(std::size_t width, std::size_t height, std::size_t each,
                  std::span<std::byte> to) {
    const std::size_t across = number<std::uint32_t>(TIFFTAG_TILEWIDTH, 0),
                      down = number<std::uint32_t>(TIFFTAG_TILELENGTH, 0);
    std::vector<std::byte> tile(static_cast<std::size_t>(TIFFTileSize(file_)));
    if (across == 0 || down == 0 || tile.size() != across * down * each) complain();
    std::uint32_t index = 0;
    for (std::size_t y = 0; y < height; y += down) {
      for (std::size_t x = 0; x < width; x += across, ++index) {
        decode(tile.size(),
               TIFFReadEncodedTile(file_, index, tile.data(), static_cast<tmsize_t>(tile.size())));
        const std::size_t bytes = std::min(across, width - x) * each;
        for (std::size_t row = 0; row < std::min(down, height - y); ++row) {
          std::copy_n(&tile[row * across * each], bytes, &to[((y + row) * width + x) * each]);
        }
      }
    }
  }

  fs::path path_;
  std::ifstream bytes_;
  TIFF* file_ = nullptr;
  std::int64_t page_ = 0;
  Message error_{}, warning_{};
};

/// Whether the page is a full image, not a reduced copy, mask, depth map or enhanced version
/// (NewSubfileType of TIFF 6.0, section 8, and of DNG 1.7).
bool is_slice(Tiff& file) {
  constexpr std::uint32_t kDepthMap = 8, kEnhanced = 16;
  constexpr std::uint32_t kNone = FILETYPE_REDUCEDIMAGE | FILETYPE_MASK | kDepthMap | kEnhanced;
  return !file.is_old_copy() && (file.number<std::uint32_t>(TIFFTAG_SUBFILETYPE) & kNone) == 0;
}

VoxelType page_type(const Tiff& file) {
  struct Type {
    std::uint16_t format, bits;
    VoxelType type;
  };
  constexpr Type kTypes[] = {
      {SAMPLEFORMAT_UINT, 8, VoxelType::uint8},      {SAMPLEFORMAT_UINT, 16, VoxelType::uint16},
      {SAMPLEFORMAT_UINT, 32, VoxelType::uint32},    {SAMPLEFORMAT_UINT, 64, VoxelType::uint64},
      {SAMPLEFORMAT_INT, 8, VoxelType::int8},        {SAMPLEFORMAT_INT, 16, VoxelType::int16},
      {SAMPLEFORMAT_INT, 32, VoxelType::int32},      {SAMPLEFORMAT_INT, 64, VoxelType::int64},
      {SAMPLEFORMAT_IEEEFP, 32, VoxelType::float32}, {SAMPLEFORMAT_IEEEFP, 64, VoxelType::float64}};
  const auto bits = file.number<std::uint16_t>(TIFFTAG_BITSPERSAMPLE, 1);
  auto format = file.number<std::uint16_t>(TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
  // "would typically treat the image data as if it were unsigned integer data", section 19.
  if (format == SAMPLEFORMAT_VOID) format = SAMPLEFORMAT_UINT;
  const auto* const found = std::ranges::find_if(
      kTypes, [&](const Type& type) { return type.format == format && type.bits == bits; });
  if (found != std::end(kTypes)) return found->type;
  const char* const kind = format == SAMPLEFORMAT_UINT     ? "unsigned numbers"
                           : format == SAMPLEFORMAT_INT    ? "signed numbers"
                           : format == SAMPLEFORMAT_IEEEFP ? "floats"
                                                           : "complex or unknown numbers";
  file.refuse_page(std::string(kind) + " of " + std::to_string(bits) + " bits",
                   "save it as integers of 8, 16, 32 or 64 bits or floats of 32 or 64");
}

/// Refuses a page of anything but rows of grey values from the top left.
void check_page(const Tiff& file) {
  const auto samples = file.number<std::uint16_t>(TIFFTAG_SAMPLESPERPIXEL, 1);
  const auto colour = file.number<std::uint16_t>(TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  if (samples != 1 || colour > PHOTOMETRIC_MINISBLACK) {
    file.refuse_page(samples != 1 ? std::to_string(samples) + " values per pixel"
                     : colour == PHOTOMETRIC_PALETTE
                         ? "colours of a palette"
                         : "photometric interpretation " + std::to_string(colour),
                     "save it as one grey value per pixel");
  }
  const auto orientation = file.number<std::uint16_t>(TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
  if (orientation != ORIENTATION_TOPLEFT) {
    file.refuse_page("orientation " + std::to_string(orientation) +
                         ", so its rows and columns do not run from the top left",
                     "save it with orientation 1");
  }
  const auto depth = file.number<std::uint32_t>(TIFFTAG_IMAGEDEPTH, 1);
  const auto packing = file.number<std::uint16_t>(TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  if (depth > 1) {
    file.refuse_page("a block of " + std::to_string(depth) + " slices",
                     "save each slice as a page");
  }
  if (TIFFIsCODECConfigured(packing) == 0) {
    file.refuse_page("compression " + std::to_string(packing) + " cannot be unpacked",
                     "save it without, or with deflate");
  }
}

/// Refuses a page whose number is below that of an earlier one, and keeps the highest.
void check_order(Tiff& file, int& highest) {
  const int number = file.page_number();
  if (number < 0) return;
  if (number < highest) {  // "The page numbers need not be ... in numerical order"
    file.refuse_page(
        "its PageNumber " + std::to_string(number) + " follows " + std::to_string(highest),
        "save the pages in the order of their numbers");
  }
  highest = number;
}

/// Notes how the values of the first page, and so of all, are to be understood.
void note_values(Tiff& file, Slices& slices) {
  // "imaged as white", section 8: of the display.
  if (file.number<std::uint16_t>(TIFFTAG_PHOTOMETRIC, 1) == PHOTOMETRIC_MINISWHITE) {
    slices.say("it shows 0 as white, its values are taken as they are");
  }
  if (file.number<std::uint16_t>(TIFFTAG_COMPRESSION) == COMPRESSION_JPEG) {
    slices.say("its pages are packed with loss (JPEG)");
  }
}

/// Checks all pages; returns what they have in common.
Slices slices_of(const fs::path& path) {
  Slices slices;
  std::string description;
  TiffResolution resolution;
  std::int64_t left_out = 0;
  int highest_number = 0;
  bool within = false;
  const auto text = [](std::int64_t width, std::int64_t height, VoxelType type) {
    return std::to_string(width) + " x " + std::to_string(height) + " pixels of " +
           std::string(kVoxelTypeWords[static_cast<std::size_t>(type)]);
  };
  Tiff file(path);
  while (file.next()) {
    within = within || file.has_pages_within();
    if (!is_slice(file)) {
      ++left_out;
      continue;
    }
    check_page(file);
    check_order(file, highest_number);
    const std::int64_t width = file.number<std::uint32_t>(TIFFTAG_IMAGEWIDTH),
                       height = file.number<std::uint32_t>(TIFFTAG_IMAGELENGTH);
    const VoxelType type = page_type(file);
    if (slices.size[2] == 0) {
      slices.size = {width, height, 0};
      slices.type = type;
      description = file.text(TIFFTAG_IMAGEDESCRIPTION);
      resolution = {file.number<float>(TIFFTAG_XRESOLUTION),
                    file.number<float>(TIFFTAG_YRESOLUTION),
                    file.number<std::uint16_t>(TIFFTAG_RESOLUTIONUNIT, RESUNIT_INCH)};
      note_values(file, slices);
    } else if (width != slices.size[0] || height != slices.size[1] || type != slices.type) {
      file.refuse_page(text(width, height, type) + ", and the pages before have " +
                           text(slices.size[0], slices.size[1], slices.type),
                       "keep the slices of one stack in a file, and mark reduced copies as such");
    }
    ++slices.size[2];
    check_grid(path.string(), slices.size[0], slices.size[1], slices.size[2]);
  }
  if (left_out > 0) {
    slices.say("pages left out as copies, masks or depth maps: " + std::to_string(left_out));
  }
  if (within) slices.say("images within its pages are left out");
  if (slices.size[2] == 0) {
    kerf::refuse(path.string(),
                 ": no page of it is a slice (" + slices.note + "); save each slice as a page");
  }
  describe_slices(path, description, resolution, slices);
  return slices;
}

}  // namespace

void read_tiff_slices(const fs::path& path, const SliceMemory& memory) {
  const Slices slices = slices_of(path);
  std::span<std::byte> to = memory(slices);
  if (to.empty()) return;
  const auto width = static_cast<std::size_t>(slices.size[0]),
             height = static_cast<std::size_t>(slices.size[1]);
  const std::size_t each = bytes_of(slices.type);
  Tiff file(path);
  while (file.next()) {
    if (!is_slice(file)) continue;
    file.read(width, height, each, to.first(width * height * each));
    to = to.subspan(width * height * each);
  }
}

void read_tiff(const fs::path& path, const MemoryRequest& offer) {
  UntrustedHeader claim;
  Slices slices;
  std::span<std::byte> memory, own;
  read_tiff_slices(path, [&](const Slices& found) {
    if (found.size[2] == 1) {
      kerf::refuse(path.string(), ": one page; name the folder that holds all slices");
    }
    slices = found;
    claim.size = slices.size;
    claim.voxel_bytes = static_cast<std::uint32_t>(bytes_of(slices.type));
    claim.kind = kind_of(slices.type, slices.scaling);
    claim.spacing_mm = slices.spacing_mm;
    claim.spacing_known = slices.spacing_known;
    claim.axes = kSliceAxes;
    claim.axes_known = 0;
    if (!slices.note.empty()) add_note(claim, slices.note);
    memory = offer(claim);
    own = memory.last(static_cast<std::size_t>(claim.size[0] * claim.size[1] * claim.size[2]) *
                      claim.voxel_bytes);
    return own;
  });
  convert_values(slices.type, own, claim.kind, memory, slices.scaling);
}

}  // namespace kerf::volume
