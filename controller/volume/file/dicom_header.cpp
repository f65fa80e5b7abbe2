// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/dicom_header.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csetjmp>
#include <csignal>
#include <fstream>
#include <initializer_list>
#include <new>
#include <sstream>
#include <string_view>
#include <system_error>

#include <gdcmReader.h>
#include <gdcmTransferSyntax.h>
#include <gdcmUIDs.h>

#include "controller/volume/file/dicom_elements.hpp"
#include "controller/volume/file/folder_files.hpp"
#include "controller/volume/file/header_fields.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;
using gdcm::Tag;
namespace {

/// More frames than files of a folder are read.
constexpr std::size_t kMostFrames = 20000;

/// The file meta information (PS3.10 7.1) lies within.
constexpr std::size_t kMetaBytes = 4096;

const Tag kPixelData(0x7fe0, 0x0010);
const Tag kFloatPixels(0x7fe0, 0x0008), kDoublePixels(0x7fe0, 0x0009);

std::optional<std::pair<double, double>> padding_of(const gdcm::DataSet& set,
                                                    const StoredPixels& pixels) {
  const auto numbers = [&](auto like, std::uint16_t first, std::uint16_t limit) {
    using T = decltype(like);
    std::optional<std::pair<double, double>> range;
    if (const auto from = binary<T>(set.GetDataElement(Tag(0x0028, first)))) {
      const T to = binary<T>(set.GetDataElement(Tag(0x0028, limit))).value_or(*from);
      range = std::minmax({static_cast<double>(*from), static_cast<double>(to)});
    }
    return range;
  };
  if (pixels.is_float && pixels.allocated == 32) return numbers(float{}, 0x0122, 0x0124);
  if (pixels.is_float) return numbers(double{}, 0x0123, 0x0125);
  return pixels.is_signed ? numbers(std::int16_t{}, 0x0120, 0x0121)
                          : numbers(std::uint16_t{}, 0x0120, 0x0121);
}

/// What an object is that is no image, by its SOP class (PS3.6 A); empty for images, and for
/// classes that GDCM does not know.
std::string kind_without_image(const std::string& uid) {
  gdcm::UIDs known;
  if (uid.empty() || !known.SetFromUID(uid.c_str())) return {};
  std::string name = known.GetName();
  for (const char* pixels : {"Image", "Volume", "RT Dose", "Parametric Map"}) {
    if (name.find(pixels) != name.npos || name == "Segmentation Storage") return {};
  }
  constexpr std::string_view kStorage = " Storage";
  if (const std::size_t at = name.find(kStorage); at != name.npos) name.erase(at);
  return "is a DICOM " + name + ", which holds no image";
}

constexpr const char* kNameSlices = "name a file or folder of slices";

/// Refuses what is no picture of one value per pixel.
StoredPixels pixels_of(const gdcm::DataSet& set) {
  const auto u16 = [&](std::uint16_t element) {
    return binary<std::uint16_t>(set.GetDataElement(Tag(0x0028, element)));
  };
  StoredPixels pixels;
  pixels.rows = u16(0x0010).value_or(0);
  pixels.columns = u16(0x0011).value_or(0);
  if (!u16(0x0010) && !u16(0x0011)) {
    const std::string kind = kind_without_image(text_of(set.GetDataElement(Tag(0x0008, 0x0016))));
    throw Unfit{kind.empty() ? "holds no image" : kind, kNameSlices};
  }
  const std::string colours = text_of(set.GetDataElement(Tag(0x0028, 0x0004)));
  const unsigned samples = u16(0x0002).value_or(1);
  if (samples != 1 || !(colours.empty() || colours.starts_with("MONOCHROME"))) {
    throw Unfit{std::to_string(samples) + (samples == 1 ? " value" : " values") + " per voxel (" +
                    one_line(colours) + ")",
                "save it as one grey value per voxel"};
  }
  if (pixels.rows == 0 || pixels.columns == 0) {
    throw Unfit{
        "has " + std::to_string(pixels.columns) + " x " + std::to_string(pixels.rows) + " pixels",
        "export it again"};
  }
  const bool floats = set.FindDataElement(kFloatPixels);
  const bool doubles = set.FindDataElement(kDoublePixels);
  pixels.is_float = floats || doubles;
  pixels.allocated = floats ? 32 : doubles ? 64 : u16(0x0100).value_or(0);
  pixels.stored = pixels.is_float ? pixels.allocated : u16(0x0101).value_or(0);
  if (pixels.stored == 0) pixels.stored = pixels.allocated;
  pixels.high_bit = pixels.is_float ? pixels.allocated - 1 : u16(0x0102).value_or(0);
  if (pixels.high_bit == 0) pixels.high_bit = pixels.stored - 1;
  pixels.is_signed = u16(0x0103).value_or(0) != 0;
  const bool whole_bytes =
      pixels.is_float || pixels.allocated == 8 || pixels.allocated == 16 || pixels.allocated == 32;
  if (!whole_bytes || pixels.stored > pixels.allocated || pixels.high_bit >= pixels.allocated ||
      pixels.high_bit + 1 < pixels.stored) {
    throw Unfit{"stores " + std::to_string(pixels.stored) + " of " +
                    std::to_string(pixels.allocated) + " bits up to bit " +
                    std::to_string(pixels.high_bit),
                "export it with 8, 16 or 32 bits for each value"};
  }
  pixels.padding = padding_of(set, pixels);
  return pixels;
}

/// Name of an encoding that GDCM does not know (PS3.6 A-1).
std::string syntax_name(const std::string& uid) {
  constexpr std::pair<std::string_view, const char*> kNames[] = {
      {"1.2.840.10008.1.2.4.20", "High-Throughput JPEG 2000"},
      {"1.2.840.10008.1.2.4.11", "JPEG XL"},
      {"1.2.840.10008.1.2.4.10", "video"},
      {"1.2.840.10008.1.2.4.9", "JPEG 2000 part 2 or JPIP"},
      {"1.2.840.10008.1.2.7", "video over a network"},
      {"1.2.840.10008.1.2.8", "deflated image frames"}};
  for (const auto& [start, name] : kNames) {
    if (uid.starts_with(start)) return uid + ", " + name;
  }
  return uid;
}

[[noreturn]] void refuse_syntax(const std::string& uid) {
  throw Unfit{"its encoding cannot be read (" + syntax_name(one_line(uid)) + ")",
              "export it uncompressed, as JPEG, JPEG-LS, JPEG 2000 or RLE"};
}

constexpr const char* kBroken = "voxels are missing or broken";
constexpr const char* kCopyAgain = "copy the file again";

/// Finds the pixels behind the header, which `reader` has read.
void locate_pixels(const gdcm::Reader& reader, std::uint64_t file_bytes, std::size_t frames,
                   std::ifstream& in, StoredPixels& pixels) {
  using Syntax = gdcm::TransferSyntax;
  const Syntax& syntax = reader.GetFile().GetHeader().GetDataSetTransferSyntax();
  pixels.syntax = syntax.GetString();
  if (syntax == Syntax::DeflatedExplicitVRLittleEndian || pixels.is_float) {
    pixels.in = StoredPixels::In::data_set;
    return;
  }
  // The reader stands behind the length of the pixels.
  const auto at = static_cast<std::uint64_t>(reader.GetStreamCurrentPosition());
  std::array<unsigned char, 12> head{};
  if (at < head.size() || at > file_bytes) throw Unfit{"holds no pixels", kCopyAgain};
  in.clear();
  in.seekg(static_cast<std::streamoff>(at - head.size()));
  in.read(reinterpret_cast<char*>(head.data()), head.size());
  const bool big = syntax == Syntax::ExplicitVRBigEndian;
  const bool is_explicit = syntax.IsExplicit();
  const std::size_t tag_at = is_explicit ? 0 : 4;
  const std::array<unsigned char, 4> tag = {
      big ? head[tag_at + 1] : head[tag_at], big ? head[tag_at] : head[tag_at + 1],
      big ? head[tag_at + 3] : head[tag_at + 2], big ? head[tag_at + 2] : head[tag_at + 3]};
  if (!in || tag != std::array<unsigned char, 4>{0xe0, 0x7f, 0x10, 0x00}) {
    throw Unfit{"holds no pixels", kCopyAgain};
  }
  std::uint32_t length = 0;
  for (std::size_t i = 0; i < 4; ++i) length |= std::uint32_t{head[big ? 11 - i : 8 + i]} << 8 * i;
  if (syntax.IsEncapsulated()) {
    pixels.in = StoredPixels::In::fragments;
    constexpr std::uint32_t kUndefined = 0xffffffff;
    if (length != kUndefined) throw Unfit{kBroken, kCopyAgain};
    return;
  }
  pixels.offset = at;
  pixels.big_endian = big || syntax == Syntax::ImplicitVRBigEndianPrivateGE;
  pixels.words = !is_explicit || (head[4] == 'O' && head[5] == 'W');
  const std::uint64_t wanted = frames * static_cast<std::uint64_t>(pixels.frame_bytes());
  if (length < wanted || file_bytes - at < length) throw Unfit{kBroken, kCopyAgain};
}

std::size_t frame_count(const gdcm::DataSet& set) {
  const std::string text = text_of(set.GetDataElement(Tag(0x0028, 0x0008)));
  if (text.empty()) return 1;
  const auto count = number_in(text);
  if (count && *count >= 1 && *count <= kMostFrames && *count == std::floor(*count)) {
    return static_cast<std::size_t>(*count);
  }
  throw Unfit{"NumberOfFrames " + one_line(text) + " is not 1.." + std::to_string(kMostFrames),
              "correct the file, or export it again"};
}

// Debian builds GDCM with its assertions: a header that is cut off ends the process. A handler of
// SIGABRT may leave abort() by a jump (POSIX.1 abort), so that one broken file among many is left
// out; what the library holds at that time is lost.
sigjmp_buf before_abort;
volatile std::sig_atomic_t may_jump = 0;
extern "C" void leave_abort(int /*signal*/) {
  if (may_jump != 0) siglongjmp(before_abort, 1);
}

/// Reads up to the pixels, which are not read. False if that fails.
bool read_up_to_pixels(gdcm::Reader& reader) {
  struct sigaction own {
  }, old{};
  own.sa_handler = leave_abort;
  sigaction(SIGABRT, &own, &old);
  volatile bool read = false;
  if (sigsetjmp(before_abort, 1) == 0) {
    may_jump = 1;
    try {
      read = reader.ReadUpToTag(kPixelData, {kPixelData});
    } catch (const std::bad_alloc&) {
      may_jump = 0;
      sigaction(SIGABRT, &old, nullptr);
      throw;
    } catch (...) {  // GDCM throws texts, too
      read = false;
    }
  }
  may_jump = 0;
  sigaction(SIGABRT, &old, nullptr);
  return read;
}

/// A UID in a file that GDCM cannot parse: what follows the first of these tags, whole; or empty.
std::string uid_in(std::string_view bytes, std::initializer_list<std::string_view> elements) {
  for (const std::string_view element : elements) {
    const std::size_t at = bytes.find(element);
    if (at == bytes.npos || at + 8 > bytes.size()) continue;
    const std::size_t length_at = at + (element.size() == 6 ? 6 : 4);
    const std::size_t low = element[0] == 0 ? 1 : 0;  // 1: big-endian
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
    const std::size_t length = byte(length_at + low) + std::size_t{256} * byte(length_at + 1 - low);
    constexpr std::size_t kLongestUid = 64;
    if (length <= kLongestUid && at + 8 + length <= bytes.size()) {
      return trimmed(bytes.substr(at + 8, length));
    }
  }
  return {};
}

/// If the file names an encoding that GDCM does not know: its UID; `bytes` names another one then,
/// so that the header can be read, which is in explicit little endian for all (PS3.5 A.4).
std::optional<std::string> replace_syntax(std::string& bytes) {
  using namespace std::string_view_literals;
  constexpr std::string_view kElement = "\x02\x00\x10\x00UI"sv;
  constexpr std::string_view kKnown = "1.2.840.10008.1.2.1"sv;
  const std::size_t at = std::string_view(bytes).substr(0, kMetaBytes).find(kElement);
  if (at == bytes.npos || at + 8 > bytes.size()) return std::nullopt;
  const auto length = static_cast<std::size_t>(static_cast<unsigned char>(bytes[at + 6])) |
                      static_cast<std::size_t>(static_cast<unsigned char>(bytes[at + 7])) << 8;
  if (length < kKnown.size() || at + 8 + length > bytes.size()) return std::nullopt;
  std::string uid = trimmed(std::string_view(bytes).substr(at + 8, length));
  if (gdcm::TransferSyntax::GetTSType(uid.c_str()) != gdcm::TransferSyntax::TS_END) return {};
  bytes.replace(at + 8, length, std::string(kKnown) + std::string(length - kKnown.size(), '\0'));
  return uid;
}

/// Refuses a file that shows nothing of what it was: one that cannot be opened or read, is empty,
/// or has zeroes alone, as a copy that was interrupted.
void refuse_without_content(std::ifstream& in) {
  const int reason = errno;
  if (!in) {
    throw Unfit{"cannot be opened (" + std::generic_category().message(reason) + ")",
                "check its permissions"};
  }
  std::array<char, 65536> bytes{};
  bool any = false;
  do {
    in.read(bytes.data(), bytes.size());
    const std::string_view got(bytes.data(), static_cast<std::size_t>(in.gcount()));
    if (got.find_first_not_of('\0') != got.npos) return;
    any = any || !got.empty();
  } while (in);
  if (in.bad()) throw Unfit{"cannot be read from its disc", kCopyAgain};
  throw Unfit{any ? "holds zeroes alone" : "is empty", kCopyAgain};
}

void describe(const gdcm::DataSet& set, DicomFile& file) {
  const auto text = [&](std::uint16_t group, std::uint16_t element) {
    return text_of(set.GetDataElement(Tag(group, element)));
  };
  file.series = text(0x0020, 0x000e);
  file.series_name = text(0x0008, 0x103e);
  file.series_number = number_in(text(0x0020, 0x0011)).value_or(0);
  // A slice has a grey value per pixel, or a position; one that is cut off before both has the
  // modality of slices.
  const auto samples = binary<std::uint16_t>(set.GetDataElement(Tag(0x0028, 0x0002)));
  const std::string modality = text(0x0008, 0x0060);
  const bool of_slices = modality == "CT" || modality == "MR" || modality == "PT";
  file.is_slice = (of_slices && !set.FindDataElement(Tag(0x0028, 0x0010))) ||
                  set.FindDataElement(Tag(0x0020, 0x0032)) ||
                  set.FindDataElement(Tag(0x5200, 0x9230)) ||
                  (set.FindDataElement(Tag(0x0028, 0x0010)) && samples.value_or(1) == 1);
  file.is_index = set.FindDataElement(Tag(0x0004, 0x1220));
}

}  // namespace

std::optional<DicomFile> read_dicom_header(const fs::path& path) {
  DicomFile file;
  file.path = path;
  std::ifstream in(path, std::ios::binary);
  std::error_code fault;
  const std::uint64_t file_bytes = fs::file_size(path, fault);
  try {
    refuse_without_content(in);
    const bool named = begins_as_dicom(path) || lower(path.extension().string()) == ".dcm";
    gdcm::Reader reader;
    reader.SetFileName(path.c_str());
    if (!reader.CanRead() && !named) return std::nullopt;
    if (read_up_to_pixels(reader)) {
      describe(reader.GetFile().GetDataSet(), file);
      const gdcm::DataSet& set = reader.GetFile().GetDataSet();
      file.pixels = pixels_of(set);
      const std::size_t count = frame_count(set);
      locate_pixels(reader, file_bytes, count, in, file.pixels);
      read_frames(set, count, file);
      return file;
    }
    in.clear();
    in.seekg(0);
    std::ostringstream all;
    all << in.rdbuf();
    std::string bytes = std::move(all).str();
    using namespace std::string_view_literals;
    file.series =
        uid_in(bytes, {"\x20\x00\x0e\x00UI"sv, "\x00\x20\x00\x0eUI"sv, "\x20\x00\x0e\x00"sv});
    if (!named && file.series.empty()) return std::nullopt;  // looked like one, as any file may
    const std::string bytes_of_meta = bytes.substr(0, kMetaBytes);
    const auto syntax = replace_syntax(bytes);
    std::istringstream stream(std::move(bytes));
    gdcm::Reader again;
    again.SetStream(stream);
    if (syntax && read_up_to_pixels(again)) {
      describe(again.GetFile().GetDataSet(), file);
      refuse_syntax(*syntax);
    }
    const std::string kind = kind_without_image(uid_in(bytes_of_meta, {"\x02\x00\x02\x00UI"sv}));
    file.is_index = !kind.empty();
    if (!kind.empty()) throw Unfit{kind, kNameSlices};
    file.is_slice = !file.series.empty();
    throw Unfit{"cannot be read", "check that the file is whole and of the kind its name says"};
  } catch (const Unfit& unfit) {
    file.unfit = unfit.reason;
    file.way_out = unfit.way_out;
  } catch (const std::bad_alloc&) {
    file.unfit = "its header asks for more memory than it can fill";
    file.way_out = kCopyAgain;
  }
  file.frames.clear();
  return file;
}

}  // namespace kerf::volume
