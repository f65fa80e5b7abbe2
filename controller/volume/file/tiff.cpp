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
#include "controller/volume/file/file_headers.hpp"
#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/header_fields.hpp"
#include "controller/volume/file/slices.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;
namespace {

void say(Slices& slices, const std::string& text) {
  slices.note += (slices.note.empty() ? "" : "; ") + text;
}

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

  /// Refuses a strip or tile that gives fewer bytes, or one that a decoder warns of: they fill up.
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

/// Whether the page belongs to another one: NewSubfileType of TIFF 6.0, section 8.
bool is_slice(Tiff& file) {
  constexpr std::uint32_t kNone = FILETYPE_REDUCEDIMAGE | FILETYPE_MASK;
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

/// What programs write about a stack: ImageJ `key=value` on lines, OME-XML `key="value"`, tifffile
/// a shape.
class Description {
 public:
  explicit Description(std::string text) : text_(std::move(text)) {}

  [[nodiscard]] bool is_imagej() const { return text_.starts_with("ImageJ="); }
  [[nodiscard]] bool is_ome() const { return text_.find("<OME") != std::string::npos; }

  /// Empty if there is none.
  [[nodiscard]] std::string word(const std::string& key) const {
    const bool lines = is_imagej();
    const std::string start = key + (lines ? "=" : "=\"");
    for (std::size_t at = 0; (at = text_.find(start, at)) != std::string::npos; ++at) {
      if (at == 0 ||
          std::string_view(lines ? "\n" : " \t\r\n").find(text_[at - 1]) == std::string::npos)
        continue;  // the end of a longer key
      const std::string rest = text_.substr(at + start.size());
      return rest.substr(0, rest.find_first_of(lines ? "\r\n" : "\""));
    }
    return {};
  }
  [[nodiscard]] std::optional<double> number(const std::string& key) const {
    const std::string text = word(key);
    double value = 0;
    const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (fault != std::errc{} || end != text.data() + text.size()) return {};
    return value;
  }
  /// Names and lengths of the axes beyond rows and columns.
  [[nodiscard]] std::vector<std::pair<std::string, double>> axes() const {
    std::vector<std::pair<std::string, double>> found;
    for (const char* const key : {"channels", "slices", "frames", "SizeC", "SizeZ", "SizeT"}) {
      if (const auto count = number(key)) found.emplace_back(key, *count);
    }
    if (!text_.starts_with("{\"shape\": [")) return found;
    std::istringstream shape(text_.substr(text_.find('[') + 1));
    char after = ',';
    for (double count = 0; after == ',' && shape >> count >> after;) {
      found.emplace_back("axis " + std::to_string(found.size() + 1), count);
    }
    found.resize(std::max<std::size_t>(found.size(), 2) - 2);
    return found;
  }
  /// Whether OME-XML has the planes in the order of the pages.
  [[nodiscard]] bool in_order() const {
    for (std::size_t at = 0; (at = text_.find("<TiffData", at)) != std::string::npos; ++at) {
      const Description part(text_.substr(at, text_.find('>', at) - at));
      double plane = 0;
      for (const char* const key : {"FirstZ", "FirstC", "FirstT"}) {
        plane += part.number(key).value_or(0);
      }
      if (plane != part.number("IFD").value_or(plane)) return false;
    }
    return true;
  }

 private:
  std::string text_;
};

/// A unit in mm; none for one that is no length, such as ImageJ's `pixel`.
std::optional<double> mm_of(std::string unit) {
  constexpr std::string_view kMicro = "\\u00B5";  // as ImageJ writes it
  if (unit.starts_with(kMicro)) unit.replace(0, kMicro.size(), "u");
  const auto length = unit.empty() ? std::nullopt : length_unit(unit);
  if (!length) return {};
  return length->times / length->over;
}

/// Refuses a file whose pages are not the slices of one volume by its description.
void check_axes(const fs::path& path, const Description& description, Slices& slices) {
  double images = 1;
  std::vector<std::string> names;
  for (const auto& [name, count] : description.axes()) {
    images *= count;
    if (count > 1) names.push_back(name);
  }
  if (names.size() > 1) {
    kerf::refuse(path.string(), ": its description has " + names[0] + " and " + names[1] +
                                    "; save one volume, of slices alone, to a file of its own");
  }
  images = std::max(images, description.number("images").value_or(1));
  if (images > 1 && images != static_cast<double>(slices.size[2])) {
    kerf::refuse(path.string(), ": its description names " + short_text(images) +
                                    " images, and the file has pages for " +
                                    std::to_string(slices.size[2]) +
                                    "; save it again with a page for each image");
  }
  if (!description.in_order()) {
    kerf::refuse(path.string(), ": its OME-XML has the pages in another order; save them in order");
  }
  if (!names.empty() && names[0] != "slices" && names[0] != "SizeZ" && names[0] != "axis 1") {
    say(slices, "its " + names[0] + " are taken as slices");
  }
}

/// Sets the spacing that ImageJ or OME-XML names. Resolution alone is a size for printing, often a
/// program's constant: it is noted and not taken.
void set_spacing(const Tiff& file, const Description& description, Slices& slices) {
  const double across[] = {static_cast<double>(file.number<float>(TIFFTAG_XRESOLUTION)),
                           static_cast<double>(file.number<float>(TIFFTAG_YRESOLUTION))};
  const auto set = [&](std::size_t axis, double edge, const std::optional<double>& unit_mm) {
    if (!unit_mm || !(edge > 0) || !(edge < std::numeric_limits<double>::max())) return;
    slices.spacing_mm[axis] = edge * *unit_mm;
    slices.spacing_known |= 1U << axis;
  };
  if (description.is_imagej()) {
    const std::string unit = description.word("unit");
    const auto unit_of = [&](const char* key) {
      const std::string own = description.word(key);
      return mm_of(own.empty() ? unit : own);
    };
    set(0, 1 / across[0], mm_of(unit));
    set(1, 1 / across[1], unit_of("yunit"));
    set(2, description.number("spacing").value_or(0), unit_of("zunit"));
  } else if (description.is_ome()) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::string key = std::string("PhysicalSize") + "XYZ"[axis];
      const std::string unit = description.word(key + "Unit");
      set(axis, description.number(key).value_or(0), mm_of(unit.empty() ? "um" : unit));
    }
  } else if (across[0] > 0 && across[1] > 0) {
    const auto unit = file.number<std::uint16_t>(TIFFTAG_RESOLUTIONUNIT, RESUNIT_INCH);
    const double mm = unit == RESUNIT_INCH ? 25.4 : unit == RESUNIT_CENTIMETER ? 10 : 0;
    if (mm > 0) {
      say(slices, "its resolution for printing, " + short_text(mm / across[0]) + " x " +
                      short_text(mm / across[1]) + " mm a pixel, is not taken as its spacing");
    }
  }
}

/// ImageJ keeps signed and calibrated images as unsigned numbers and a straight line.
Scaling scaling_of(const fs::path& path, const Description& description) {
  constexpr double kStraightLine = 0, kNone = 20;  // ij.measure.Calibration
  const auto function = description.number("cf");
  if (!description.is_imagej() || !function || *function == kNone) return {};
  const auto intercept = description.number("c0"), slope = description.number("c1");
  if (*function == kStraightLine && intercept && slope) return {*slope, *intercept};
  kerf::refuse(path.string(), ": ImageJ's calibration function " + short_text(*function) +
                                  " is no straight line; save it uncalibrated");
}

/// Checks all pages; returns what they have in common.
Slices slices_of(const fs::path& path) {
  Slices slices;
  Description description("");
  std::int64_t left_out = 0;
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
    const std::int64_t width = file.number<std::uint32_t>(TIFFTAG_IMAGEWIDTH),
                       height = file.number<std::uint32_t>(TIFFTAG_IMAGELENGTH);
    const VoxelType type = page_type(file);
    if (slices.size[2] == 0) {
      slices.size = {width, height, 0};
      slices.type = type;
      description = Description(file.text(TIFFTAG_IMAGEDESCRIPTION));
      set_spacing(file, description, slices);
      slices.scaling = scaling_of(path, description);
      // "imaged as white", section 8: of the display.
      if (file.number<std::uint16_t>(TIFFTAG_PHOTOMETRIC, 1) == PHOTOMETRIC_MINISWHITE) {
        say(slices, "it shows 0 as white, its values are taken as they are");
      }
      if (file.number<std::uint16_t>(TIFFTAG_COMPRESSION) == COMPRESSION_JPEG) {
        say(slices, "its pages are packed with loss (JPEG)");
      }
    } else if (width != slices.size[0] || height != slices.size[1] || type != slices.type) {
      file.refuse_page(text(width, height, type) + ", and the pages before have " +
                           text(slices.size[0], slices.size[1], slices.type),
                       "keep the slices of one stack in a file, and mark reduced copies as such");
    }
    ++slices.size[2];
    check_grid(path.string(), slices.size[0], slices.size[1], slices.size[2]);
  }
  if (left_out > 0) {
    say(slices, std::to_string(left_out) + " of its pages are reduced copies or masks, left out");
  }
  if (within) say(slices, "images within its pages are left out");
  if (slices.size[2] == 0) {
    kerf::refuse(path.string(),
                 ": no page of it is a slice (" + slices.note + "); save each slice as a page");
  }
  check_axes(path, description, slices);
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
    if (!slices.note.empty()) add_note(claim, slices.note);
    memory = offer(claim);
    own = memory.last(static_cast<std::size_t>(claim.size[0] * claim.size[1] * claim.size[2]) *
                      claim.voxel_bytes);
    return own;
  });
  convert_values(slices.type, own, claim.kind, memory, slices.scaling);
}

}  // namespace kerf::volume
