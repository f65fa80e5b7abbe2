// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/dicom_pixels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <string_view>
#include <tuple>
#include <type_traits>

#include <gdcmImageCodec.h>
#include <gdcmJPEG2000Codec.h>
#include <gdcmJPEGCodec.h>
#include <gdcmJPEGLSCodec.h>
#include <gdcmRLECodec.h>
#include <gdcmReader.h>
#include <gdcmSequenceOfFragments.h>

#include "controller/input/load_error.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;
namespace {

const gdcm::Tag kStoredPixels(0x7fe0, 0x0010);

[[noreturn]] void refuse_missing(const fs::path& path) {
  throw LoadError(path.string() + ": voxels are missing or broken; copy the file again");
}

/// The number in the bits of a cell that the file stores (PS3.5 8.1.1), without what older files
/// keep in the others, such as overlays.
double number_in_cell(const StoredPixels& pixels, std::uint32_t cell) noexcept {
  const unsigned above = 31 - pixels.high_bit, unused = 32 - pixels.stored;
  const std::uint32_t bits = cell << above;
  return pixels.is_signed ? static_cast<double>(static_cast<std::int32_t>(bits) >> unused)
                          : static_cast<double>(bits >> unused);
}

bool is_padding(const StoredPixels& pixels, double value) noexcept {
  if (!pixels.padding) return false;
  const auto [first, last] = *pixels.padding;
  return (first <= value && value <= last) || (std::isnan(first) && std::isnan(value));
}

/// Padding may be a number that only the whole cell holds.
bool is_padding(const StoredPixels& pixels, std::uint32_t cell) noexcept {
  StoredPixels whole = pixels;
  whole.stored = pixels.allocated;
  whole.high_bit = pixels.allocated - 1;
  return is_padding(pixels, number_in_cell(pixels, cell)) ||
         is_padding(pixels, number_in_cell(whole, cell));
}

double value_of(const ModalityTransform& transform, double stored) noexcept {
  if (!transform.lut) return transform.slope * stored + transform.intercept;
  const auto& [first, values] = *transform.lut;
  const double last = static_cast<double>(values.size() - 1);
  const double at = std::clamp(stored - static_cast<double>(first), 0.0, last);
  return values[static_cast<std::size_t>(at)];
}

/// Least and largest value that the bits of a slice can mean, and whether all are whole numbers.
struct Range {
  double least, most;
  bool whole;
};

Range range_of(const DicomSlice& slice) {
  const StoredPixels& pixels = slice.file->pixels;
  const ModalityTransform& transform = slice.frame->transform;
  if (pixels.is_float) {
    const double most = std::numeric_limits<double>::max();
    return {-most, most, false};
  }
  if (transform.lut) {
    const auto [least, most] = std::ranges::minmax(transform.lut->values);
    return {static_cast<double>(least), static_cast<double>(most), true};
  }
  const double values = std::ldexp(1.0, static_cast<int>(pixels.stored));
  const double first = pixels.is_signed ? -values / 2 : 0;
  const double a = value_of(transform, first), b = value_of(transform, first + values - 1);
  const bool whole = transform.slope == std::floor(transform.slope) &&
                     transform.intercept == std::floor(transform.intercept);
  return {std::min(a, b), std::max(a, b), whole};
}

constexpr float kAirHu = -1000;

}  // namespace

DicomValues values_of(const std::vector<DicomSlice>& slices) {
  Range all = range_of(slices.front());
  DicomValues values;
  values.air = kAirHu;
  for (const DicomSlice& slice : slices) {
    const Range range = range_of(slice);
    all = {std::min(all.least, range.least), std::max(all.most, range.most),
           all.whole && range.whole};
    const bool has_air = range.least <= static_cast<double>(kAirHu);
    if (!slice.file->in_hounsfield || !has_air) values.air.reset();
    values.marks_padding = values.marks_padding || slice.file->pixels.padding;
  }
  if (values.air) values.marks_padding = false;
  const auto fits = [&](auto least, auto most) {
    return all.whole && all.least >= static_cast<double>(least) &&
           all.most <= static_cast<double>(most);
  };
  using Signed = std::numeric_limits<std::int16_t>;
  if (fits(Signed::min(), Signed::max())) {
    values.kind = ValueKind::int16;
  } else if (fits(0, std::numeric_limits<std::uint16_t>::max())) {
    values.kind = ValueKind::uint16;
  }
  return values;
}

/// What is kept of the file that is read, and of the last conversion.
struct DicomPixels::OpenFile {
  const DicomFile* file = nullptr;
  std::ifstream in;                      ///< pixels that lie in the file as they are
  std::unique_ptr<gdcm::Reader> reader;  ///< others
  std::vector<std::pair<std::size_t, std::size_t>> parts;  ///< fragments of each frame: from, to

  // Values of all cells of up to 16 bits.
  std::vector<std::byte> table;
  std::vector<bool> padding;
  StoredPixels table_pixels;
  ModalityTransform table_transform;
};

DicomPixels::DicomPixels(const DicomValues& values)
    : values_(values), open_(std::make_unique<OpenFile>()) {}
DicomPixels::~DicomPixels() = default;

namespace {

/// Which fragments belong to which frame (PS3.5 A.4): all to a single one, else one to each, else
/// as the offset table says.
std::vector<std::pair<std::size_t, std::size_t>> parts_of(const DicomFile& file,
                                                          const gdcm::SequenceOfFragments& all) {
  const std::size_t frames = file.frames.size(), fragments = all.GetNumberOfFragments();
  std::vector<std::pair<std::size_t, std::size_t>> parts;
  if (fragments < frames) refuse_missing(file.path);
  if (frames == 1) return {{0, fragments}};
  if (fragments == frames) {
    for (std::size_t i = 0; i < frames; ++i) parts.emplace_back(i, i + 1);
    return parts;
  }
  const gdcm::ByteValue* table = all.GetTable().GetByteValue();
  std::vector<std::uint32_t> offsets(table == nullptr ? 0 : table->GetLength() / 4);
  if (!offsets.empty()) std::memcpy(offsets.data(), table->GetPointer(), 4 * offsets.size());
  std::uint64_t at = 0;
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < fragments; ++i) {
    if (starts.size() < offsets.size() && offsets[starts.size()] == at) starts.push_back(i);
    constexpr std::uint64_t kItemHead = 8;
    at += kItemHead + all.GetFragment(i).GetVL();
  }
  if (starts.size() != frames || starts.front() != 0) {
    throw LoadError(file.path.string() + ": " + std::to_string(fragments) + " packed parts for " +
                    std::to_string(frames) +
                    " frames, and no table of them; export it uncompressed");
  }
  starts.push_back(fragments);
  for (std::size_t i = 0; i < frames; ++i) parts.emplace_back(starts[i], starts[i + 1]);
  return parts;
}

std::unique_ptr<gdcm::ImageCodec> codec_of(const DicomFile& file) {
  const gdcm::TransferSyntax syntax(gdcm::TransferSyntax::GetTSType(file.pixels.syntax.c_str()));
  std::unique_ptr<gdcm::ImageCodec> codecs[] = {
      std::make_unique<gdcm::RLECodec>(), std::make_unique<gdcm::JPEGCodec>(),
      std::make_unique<gdcm::JPEGLSCodec>(), std::make_unique<gdcm::JPEG2000Codec>()};
  static_cast<gdcm::RLECodec&>(*codecs[0]).SetBufferLength(file.pixels.frame_bytes());
  for (auto& codec : codecs) {
    if (codec->CanDecode(syntax)) return std::move(codec);
  }
  throw LoadError(file.path.string() + ": its encoding cannot be read (" + file.pixels.syntax +
                  "); export it uncompressed, as JPEG, JPEG-LS, JPEG 2000 or RLE");
}

/// JPEG in all its forms ends with a mark, which a decoder replaces if it is missing.
bool has_end(std::string_view bytes, bool is_rle) {
  while (bytes.ends_with('\0') || bytes.ends_with('\xff')) bytes.remove_suffix(1);  // padding
  return is_rle || bytes.ends_with("\xff\xd9");
}

/// Decodes one frame.
void decode(const DicomFile& file, const gdcm::SequenceOfFragments& all,
            std::pair<std::size_t, std::size_t> part, std::span<std::byte> to) {
  const StoredPixels& pixels = file.pixels;
  auto codec = codec_of(file);
  const bool is_rle = dynamic_cast<gdcm::RLECodec*>(codec.get()) != nullptr;
  const gdcm::SmartPointer<gdcm::SequenceOfFragments> own = new gdcm::SequenceOfFragments;
  for (std::size_t i = part.first; i < part.second; ++i) own->AddFragment(all.GetFragment(i));
  const gdcm::ByteValue* last = all.GetFragment(part.second - 1).GetByteValue();
  if (last == nullptr || !has_end({last->GetPointer(), last->GetLength()}, is_rle)) {
    refuse_missing(file.path);
  }
  gdcm::DataElement packed(kStoredPixels, 0xffffffff, gdcm::VR::OB), cells;
  packed.SetValue(*own);
  const unsigned size[] = {static_cast<unsigned>(pixels.columns),
                           static_cast<unsigned>(pixels.rows), 1};
  codec->SetNumberOfDimensions(2);
  codec->SetDimensions(size);
  codec->SetPlanarConfiguration(0);
  codec->SetPhotometricInterpretation(gdcm::PhotometricInterpretation::MONOCHROME2);
  const auto u16 = [](unsigned value) { return static_cast<unsigned short>(value); };
  codec->SetPixelFormat(gdcm::PixelFormat(1, u16(pixels.allocated), u16(pixels.stored),
                                          u16(pixels.high_bit), pixels.is_signed ? 1 : 0));
  const bool decoded = codec->Decode(packed, cells);
  const gdcm::ByteValue* bytes = decoded ? cells.GetByteValue() : nullptr;
  if (bytes == nullptr || bytes->GetLength() < to.size() ||
      bytes->GetLength() > to.size() + to.size() % 2) {
    refuse_missing(file.path);
  }
  std::memcpy(to.data(), bytes->GetPointer(), to.size());
}

/// To this machine's byte order, from that of the file; cells of 8 bits may lie in words.
void swap_bytes(const StoredPixels& pixels, std::span<std::byte> cells) {
  const std::size_t each = pixels.allocated == 8 ? (pixels.words ? 2 : 1) : pixels.allocated / 8;
  for (std::size_t at = 0; each > 1 && at + each <= cells.size(); at += each) {
    std::ranges::reverse(cells.subspan(at, each));
  }
}

}  // namespace

void DicomPixels::open(const DicomFile& file) {
  OpenFile& now = *open_;
  if (now.file == &file) return;
  now.file = &file;
  now.reader.reset();
  now.parts.clear();
  if (now.in.is_open()) now.in.close();
  if (file.pixels.in == StoredPixels::In::file) {
    now.in.clear();
    now.in.open(file.path, std::ios::binary);
    return;
  }
  now.reader = std::make_unique<gdcm::Reader>();
  now.reader->SetFileName(file.path.c_str());
  bool read = false;
  try {
    read = now.reader->Read();
  } catch (const std::bad_alloc&) {
    throw;         // the sandbox reports the limit
  } catch (...) {  // GDCM throws texts, too
  }
  if (!read) refuse_missing(file.path);
}

/// Fills `cells_` with the frame's, as stored.
void DicomPixels::read_cells(const DicomSlice& slice) {
  const DicomFile& file = *slice.file;
  const StoredPixels& pixels = file.pixels;
  open(file);
  cells_.resize(pixels.frame_bytes());
  if (pixels.in == StoredPixels::In::file) {
    open_->in.seekg(
        static_cast<std::streamoff>(pixels.offset + slice.frame->index * cells_.size()));
    open_->in.read(reinterpret_cast<char*>(cells_.data()),
                   static_cast<std::streamsize>(cells_.size()));
    if (!open_->in) refuse_missing(file.path);
    if (pixels.big_endian) swap_bytes(pixels, cells_);
    return;
  }
  const gdcm::DataSet& set = open_->reader->GetFile().GetDataSet();
  if (pixels.in == StoredPixels::In::fragments) {
    const gdcm::SequenceOfFragments* all =
        set.GetDataElement(kStoredPixels).GetSequenceOfFragments();
    if (all == nullptr || all->GetNumberOfFragments() == 0) refuse_missing(file.path);
    if (open_->parts.empty()) open_->parts = parts_of(file, *all);
    return decode(file, *all, open_->parts[slice.frame->index], cells_);
  }
  const gdcm::Tag tag = !pixels.is_float         ? kStoredPixels
                        : pixels.allocated == 32 ? gdcm::Tag(0x7fe0, 0x0008)
                                                 : gdcm::Tag(0x7fe0, 0x0009);
  const gdcm::ByteValue* bytes = set.GetDataElement(tag).GetByteValue();
  const std::size_t at = slice.frame->index * cells_.size();
  if (bytes == nullptr || bytes->GetLength() < at + cells_.size()) refuse_missing(file.path);
  std::memcpy(cells_.data(), bytes->GetPointer() + at, cells_.size());
}

template <class T>
void DicomPixels::convert(const DicomSlice& slice, std::span<std::byte> to) {
  const StoredPixels& pixels = slice.file->pixels;
  const ModalityTransform& transform = slice.frame->transform;
  const std::span<T> values(reinterpret_cast<T*>(to.data()), pixels.cells());
  const T air = static_cast<T>(values_.air.value_or(0));
  const bool keep_padding = values_.marks_padding;
  const std::size_t before = padded_.size();
  if (keep_padding) padded_.resize(before + values.size());
  const auto each = [&]<class Cell>(Cell) {
    const auto* cells = reinterpret_cast<const Cell*>(cells_.data());
    for (std::size_t i = 0; i < values.size(); ++i) {
      bool padding = false;
      double stored = 0;
      if constexpr (std::is_floating_point_v<Cell>) {
        stored = static_cast<double>(cells[i]);
        padding = is_padding(pixels, stored);
      } else {
        stored = number_in_cell(pixels, cells[i]);
        padding = pixels.padding && is_padding(pixels, std::uint32_t{cells[i]});
      }
      values[i] = padding ? air : static_cast<T>(value_of(transform, stored));
      if (keep_padding) padded_[before + i] = padding;
    }
  };
  // Cells of up to 16 bits by a table of all, if that is no longer than the frame: each may have a
  // transform of its own.
  const auto by_table = [&]<class Cell>(Cell cell_type) {
    constexpr std::size_t kCells = std::size_t{1} << 8 * sizeof(Cell);
    if (values.size() < kCells) return each(cell_type);
    OpenFile& now = *open_;
    const auto key = [](const StoredPixels& p) {
      return std::tuple(p.allocated, p.stored, p.high_bit, p.is_signed, p.padding);
    };
    if (now.table.empty() || now.table_transform != transform ||
        key(now.table_pixels) != key(pixels)) {
      now.table.resize(kCells * sizeof(T));
      now.padding.assign(kCells, false);
      auto* table = reinterpret_cast<T*>(now.table.data());
      for (std::uint32_t cell = 0; cell < kCells; ++cell) {
        const bool padding = pixels.padding && is_padding(pixels, cell);
        now.padding[cell] = padding;
        table[cell] =
            padding ? air : static_cast<T>(value_of(transform, number_in_cell(pixels, cell)));
      }
      now.table_pixels = pixels;
      now.table_transform = transform;
    }
    const auto* table = reinterpret_cast<const T*>(now.table.data());
    const auto* cells = reinterpret_cast<const Cell*>(cells_.data());
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = table[cells[i]];
    if (!keep_padding) return;
    for (std::size_t i = 0; i < values.size(); ++i) padded_[before + i] = now.padding[cells[i]];
  };
  if (pixels.is_float) return pixels.allocated == 32 ? each(float{}) : each(double{});
  if (pixels.allocated == 8) return by_table(std::uint8_t{});
  if (pixels.allocated == 16) return by_table(std::uint16_t{});
  each(std::uint32_t{});
}

void DicomPixels::read(const DicomSlice& slice, std::span<std::byte> to) {
  read_cells(slice);
  switch (values_.kind) {
    case ValueKind::int16:
      return convert<std::int16_t>(slice, to);
    case ValueKind::uint16:
      return convert<std::uint16_t>(slice, to);
    case ValueKind::float32:
      return convert<float>(slice, to);
  }
}

void DicomPixels::fill_padding(std::span<std::byte> all) const {
  const auto fill = [&]<class T>(T) {
    auto* values = reinterpret_cast<T*>(all.data());
    std::optional<T> lowest;
    for (std::size_t i = 0; i < padded_.size(); ++i) {
      if (!padded_[i] && (!lowest || values[i] < *lowest)) lowest = values[i];
    }
    for (std::size_t i = 0; i < padded_.size(); ++i) {
      if (padded_[i]) values[i] = lowest.value_or(T{});
    }
  };
  if (values_.kind == ValueKind::int16) return fill(std::int16_t{});
  if (values_.kind == ValueKind::uint16) return fill(std::uint16_t{});
  fill(float{});
}

}  // namespace kerf::volume
