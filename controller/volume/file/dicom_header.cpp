// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/dicom_header.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <csetjmp>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <new>
#include <set>
#include <span>
#include <sstream>
#include <string_view>
#include <system_error>

#include <gdcmDataSet.h>
#include <gdcmReader.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmTransferSyntax.h>

#include "shared/text/text.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;
using gdcm::Tag;

double rounding_of(int decimals) noexcept {
  return decimals > 0 ? 0.5 * std::pow(10, -decimals) : 0;
}

namespace {

/// More frames than files of a folder are read.
constexpr std::size_t kMostFrames = 20000;

/// A reason why a file is no part of a volume, and the way out.
struct Unfit {
  std::string reason, way_out;
};

/// Without the padding to an even length.
std::string trimmed(std::string_view text) {
  constexpr std::string_view kPadding{" \0", 2};
  const std::size_t first = text.find_first_not_of(kPadding);
  if (first == text.npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(kPadding) + 1 - first));
}

std::optional<WrittenNumber> written_number(std::string_view padded) {
  std::string text = trimmed(padded);
  if (text.starts_with('+')) text.erase(0, 1);
  const auto value = number_in(text);
  if (!value) return std::nullopt;
  const std::size_t mantissa_end = std::min(text.find_first_of("eE"), text.size());
  const std::size_t point = std::min(text.find('.'), mantissa_end);
  int exponent = 0;
  if (mantissa_end < text.size()) {
    const std::size_t at = mantissa_end + (text[mantissa_end + 1] == '+' ? 2 : 1);
    std::from_chars(text.data() + at, text.data() + text.size(), exponent);
  }
  std::size_t end = mantissa_end;
  while (end > point + 1 && text[end - 1] == '0') --end;
  const auto behind_point = static_cast<int>(end - std::min(point + 1, end));
  return WrittenNumber{*value, std::max(behind_point - exponent, 0)};
}

/// As many numbers as asked for, with backslashes between; none if any part is something else.
template <std::size_t N>
std::optional<std::array<WrittenNumber, N>> written_numbers(std::string_view text) {
  std::array<WrittenNumber, N> numbers{};
  for (std::size_t i = 0; i < N; ++i) {
    const std::size_t end = text.find('\\');
    if ((end == text.npos) != (i + 1 == N)) return std::nullopt;
    const auto number = written_number(text.substr(0, end));
    if (!number) return std::nullopt;
    numbers[i] = *number;
    if (end != text.npos) text.remove_prefix(end + 1);
  }
  return numbers;
}

std::string_view bytes_of(const gdcm::DataElement& element) {
  const gdcm::ByteValue* value = element.GetByteValue();
  if (value == nullptr || value->GetPointer() == nullptr) return {};
  return {value->GetPointer(), value->GetLength()};
}

std::string text_of(const gdcm::DataElement& element) {
  return trimmed(bytes_of(element));
}

/// Number `at` of an element of binary numbers.
template <class T>
std::optional<T> binary(const gdcm::DataElement& element, std::size_t at = 0) {
  const std::string_view bytes = bytes_of(element);
  if (bytes.size() < (at + 1) * sizeof(T)) return std::nullopt;
  T value{};
  std::memcpy(&value, bytes.data() + at * sizeof(T), sizeof value);
  return value;
}

/// Data set of an item of a sequence, from 0; none if there is no such item.
std::optional<gdcm::DataSet> item(const gdcm::DataSet& set, const Tag& sequence, std::size_t at) {
  if (!set.FindDataElement(sequence) || set.GetDataElement(sequence).IsEmpty()) return {};
  const auto items = set.GetDataElement(sequence).GetValueAsSQ();
  if (!items || at >= items->GetNumberOfItems()) return {};
  return items->GetItem(at + 1).GetNestedDataSet();
}

/// The facts of one frame: its own functional groups, those of all frames, the top of the file.
class Facts {
 public:
  /// The parts outlive the object.
  Facts(const gdcm::DataSet* own, const gdcm::DataSet* shared, const gdcm::DataSet* top)
      : levels_{own, shared, top} {}

  /// An element, in the sequence `group` or, of older files, on the top of the file.
  [[nodiscard]] gdcm::DataElement find(const Tag& group, const Tag& tag) const {
    for (const gdcm::DataSet* level : levels_) {
      if (level == nullptr) continue;
      const auto inside = item(*level, group, 0);
      if (inside && inside->FindDataElement(tag)) return inside->GetDataElement(tag);
    }
    return levels_[2]->GetDataElement(tag);
  }
  [[nodiscard]] std::string text(const Tag& group, const Tag& tag) const {
    return text_of(find(group, tag));
  }
  /// If any level has the sequence.
  [[nodiscard]] std::optional<gdcm::DataSet> group(const Tag& sequence) const {
    for (const gdcm::DataSet* level : levels_) {
      if (level == nullptr) continue;
      if (auto inside = item(*level, sequence, 0)) return inside;
    }
    return {};
  }

 private:
  std::array<const gdcm::DataSet*, 3> levels_;
};

const Tag kNoGroup(0, 0);
const Tag kSharedGroups(0x5200, 0x9229), kFrameGroups(0x5200, 0x9230);
const Tag kFrameContent(0x0020, 0x9111), kMeasures(0x0028, 0x9110);
const Tag kTransformation(0x0028, 0x9145);
const Tag kPixelData(0x7fe0, 0x0010);
const Tag kFloatPixels(0x7fe0, 0x0008), kDoublePixels(0x7fe0, 0x0009);

/// What may differ between two volumes of one series, the surest first.
struct Mark {
  const char* name;
  Tag group, tag;
  enum class As : std::uint8_t { text, u16, u32, f32, f64 } as;
};
const Mark kMarks[] = {
    {"TemporalPositionIndex", kFrameContent, Tag(0x0020, 0x9128), Mark::As::u32},
    {"TemporalPositionIdentifier", kNoGroup, Tag(0x0020, 0x0100), Mark::As::text},
    {"StackID", kFrameContent, Tag(0x0020, 0x9056), Mark::As::text},
    {"EchoNumbers", kNoGroup, Tag(0x0018, 0x0086), Mark::As::text},
    {"EffectiveEchoTime", Tag(0x0018, 0x9114), Tag(0x0018, 0x9082), Mark::As::f64},
    {"ReferencedSegmentNumber", Tag(0x0062, 0x000a), Tag(0x0062, 0x000b), Mark::As::u16},
    {"DiffusionBValue", Tag(0x0018, 0x9117), Tag(0x0018, 0x9087), Mark::As::f64},
    {"TemporalPositionTimeOffset", Tag(0x0020, 0x9310), Tag(0x0020, 0x930d), Mark::As::f64},
    {"NominalPercentageOfCardiacPhase", Tag(0x0018, 0x9118), Tag(0x0020, 0x9241), Mark::As::f32},
    {"TriggerTime", kNoGroup, Tag(0x0018, 0x1060), Mark::As::text},
    {"EchoTime", kNoGroup, Tag(0x0018, 0x0081), Mark::As::text},
    {"AcquisitionNumber", kNoGroup, Tag(0x0020, 0x0012), Mark::As::text},
    {"FrameAcquisitionNumber", kFrameContent, Tag(0x0020, 0x9156), Mark::As::u16},
    {"CT FrameType", Tag(0x0018, 0x9329), Tag(0x0008, 0x9007), Mark::As::text},
    {"MR FrameType", Tag(0x0018, 0x9226), Tag(0x0008, 0x9007), Mark::As::text},
    {"ImageType", kNoGroup, Tag(0x0008, 0x0008), Mark::As::text},
    {"ConvolutionKernel", Tag(0x0018, 0x9314), Tag(0x0018, 0x1210), Mark::As::text},
    {"KVP", Tag(0x0018, 0x9325), Tag(0x0018, 0x0060), Mark::As::text},
    {"AcquisitionTime", kNoGroup, Tag(0x0008, 0x0032), Mark::As::text},
    {"ContentTime", kNoGroup, Tag(0x0008, 0x0033), Mark::As::text}};

std::string text_of(const gdcm::DataElement& element, Mark::As as) {
  const auto shown = [](const auto& value) {
    return value ? number_text(static_cast<double>(*value)) : std::string();
  };
  switch (as) {
    case Mark::As::u16:
      return shown(binary<std::uint16_t>(element));
    case Mark::As::u32:
      return shown(binary<std::uint32_t>(element));
    case Mark::As::f32:
      return shown(binary<float>(element));
    case Mark::As::f64:
      return shown(binary<double>(element));
    case Mark::As::text:
      break;
  }
  return text_of(element);
}

std::vector<std::pair<std::string, std::string>> marks_of(const Facts& facts) {
  std::vector<std::pair<std::string, std::string>> marks;
  for (const Mark& mark : kMarks) {
    std::string text = text_of(facts.find(mark.group, mark.tag), mark.as);
    if (!text.empty()) marks.emplace_back(mark.name, std::move(text));
  }
  // Dimensions of the file's own choice: one index each.
  const gdcm::DataElement indices = facts.find(kFrameContent, Tag(0x0020, 0x9157));
  constexpr std::size_t kMostDimensions = 8;
  for (std::size_t i = 0; i < kMostDimensions; ++i) {
    const auto index = binary<std::uint32_t>(indices, i);
    if (!index) break;
    marks.emplace_back("DimensionIndexValues " + std::to_string(i + 1), std::to_string(*index));
  }
  return marks;
}

/// The table of a Modality LUT item.
std::shared_ptr<const DicomLut> lut_of(const gdcm::DataSet& set, bool signed_cells) {
  const gdcm::DataElement& descriptor = set.GetDataElement(Tag(0x0028, 0x3002));
  const gdcm::DataElement& data = set.GetDataElement(Tag(0x0028, 0x3006));
  const auto entries = binary<std::uint16_t>(descriptor);
  const auto first = binary<std::uint16_t>(descriptor, 1);
  constexpr std::size_t kAllOf16Bits = 65536;
  const std::size_t count = entries && *entries != 0 ? *entries : kAllOf16Bits;
  const std::string_view bytes = bytes_of(data);
  const bool wide = bytes.size() == 2 * count;
  if (!first || (!wide && bytes.size() != count + count % 2)) {
    throw Unfit{"its Modality LUT has " + std::to_string(bytes.size()) + " bytes for " +
                    std::to_string(count) + " values",
                "export it again"};
  }
  auto lut = std::make_shared<DicomLut>();
  lut->first = signed_cells ? static_cast<std::int16_t>(*first) : *first;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint16_t value = wide ? binary<std::uint16_t>(data, i).value_or(0)
                                     : binary<std::uint8_t>(data, i).value_or(0);
    lut->values.push_back(data.GetVR() == gdcm::VR::SS ? static_cast<std::int16_t>(value) : value);
  }
  return lut;
}

/// The number in a tag of the rescale; `usual` if the tag is not there or empty.
double rescale_number(const Facts& facts, const Tag& tag, const char* name, double usual) {
  const std::string text = facts.text(kTransformation, tag);
  if (text.empty()) return usual;
  const auto number = written_number(text);
  if (number && (number->value != 0 || usual == 0)) return number->value;
  throw Unfit{std::string(name) + ' ' + one_line(text) + " makes no values",
              "correct the file, or export it again"};
}

/// PS3.3 C.11.1: a LUT or a line, never both.
ModalityTransform transform_of(const Facts& facts, bool signed_cells) {
  ModalityTransform transform;
  transform.slope = rescale_number(facts, Tag(0x0028, 0x1053), "RescaleSlope", 1);
  transform.intercept = rescale_number(facts, Tag(0x0028, 0x1052), "RescaleIntercept", 0);
  if (const auto set = facts.group(Tag(0x0028, 0x3000))) {
    if (transform != ModalityTransform{}) {
      throw Unfit{"has a Modality LUT and a RescaleSlope or RescaleIntercept",
                  "leave one of them out"};
    }
    transform.lut = lut_of(*set, signed_cells);
  }
  return transform;
}

/// Two distances above 0; none otherwise.
std::optional<std::array<WrittenNumber, 2>> spacing_of(const Facts& facts) {
  const auto spacing = written_numbers<2>(facts.text(kMeasures, Tag(0x0028, 0x0030)));
  return spacing && (*spacing)[0].value > 0 && (*spacing)[1].value > 0 ? spacing : std::nullopt;
}

/// Refuses an orientation that is not two directions of length 1 at right angles.
void check_directions(const DicomFrame& frame) {
  if (!frame.orientation) return;
  constexpr double kRounded = 2e-3;  // as in set_frame of volume_io.cpp
  std::array<double, 3> products{-1, -1, 0};
  for (std::size_t i = 0; i < 3; ++i) {
    const double x = (*frame.orientation)[i].value, y = (*frame.orientation)[3 + i].value;
    products[0] += x * x;
    products[1] += y * y;
    products[2] += x * y;
  }
  if (std::ranges::all_of(products, [](double off) { return std::abs(off) < kRounded; })) return;
  throw Unfit{"ImageOrientationPatient is not two directions at right angles",
              "correct the file, or export it again"};
}

DicomFrame frame_of(const Facts& facts, std::size_t index, const StoredPixels& pixels) {
  DicomFrame frame;
  frame.index = index;
  const auto numbers = [&](auto& to, const Tag& group, const Tag& tag, const char* name) {
    const std::string text = facts.text(group, tag);
    to = written_numbers<std::tuple_size_v<typename std::decay_t<decltype(to)>::value_type>>(text);
    if (to || text.empty()) return;
    throw Unfit{std::string(name) + " '" + one_line(text) + "' is no list of numbers",
                "correct the file, or export it again"};
  };
  numbers(frame.position_mm, Tag(0x0020, 0x9113), Tag(0x0020, 0x0032), "ImagePositionPatient");
  numbers(frame.orientation, Tag(0x0020, 0x9116), Tag(0x0020, 0x0037), "ImageOrientationPatient");
  check_directions(frame);
  frame.spacing_mm = spacing_of(facts);
  if (const auto distance = written_number(facts.text(kMeasures, Tag(0x0018, 0x0088)))) {
    frame.distance_mm = distance->value;
  }
  frame.location_mm = written_number(facts.text(kNoGroup, Tag(0x0020, 0x1041)));
  frame.transform = transform_of(facts, pixels.is_signed);
  frame.marks = marks_of(facts);
  return frame;
}

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

/// Refuses what is no picture of one value per pixel.
StoredPixels pixels_of(const gdcm::DataSet& set) {
  const auto u16 = [&](std::uint16_t element) {
    return binary<std::uint16_t>(set.GetDataElement(Tag(0x0028, element)));
  };
  StoredPixels pixels;
  pixels.rows = u16(0x0010).value_or(0);
  pixels.columns = u16(0x0011).value_or(0);
  if (!u16(0x0010) && !u16(0x0011)) {
    throw Unfit{"holds no image", "name a file or folder of slices"};
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

/// Refuses frames that follow one another in time or by views, not through a body: the tag that
/// counts them says so.
void refuse_no_slices(const gdcm::DataSet& set) {
  const gdcm::DataElement& pointers = set.GetDataElement(Tag(0x0028, 0x0009));
  constexpr std::uint32_t kSlices[] = {0x3004000c, 0x00540080, 0x00182001};
  for (std::size_t i = 0; const auto group = binary<std::uint16_t>(pointers, i); i += 2) {
    const std::uint32_t tag =
        std::uint32_t{*group} << 16 | binary<std::uint16_t>(pointers, i + 1).value_or(0);
    if (std::ranges::find(kSlices, tag) != std::end(kSlices)) continue;
    std::array<char, 16> text{};
    std::snprintf(text.data(), text.size(), "(%04x,%04x)", tag >> 16, tag & 0xffff);
    throw Unfit{std::string("its frames are counted by ") + text.data() +
                    ", a time or a view, and are no slices",
                "name a file or folder of slices"};
  }
}

/// Positions of the frames of a file without functional groups: they follow one another in the
/// order of the file, by a table (RT dose, PS3.3 C.8.8.3.2) or by one distance.
void place_frames(const gdcm::DataSet& set, DicomFile& file) {
  refuse_no_slices(set);
  const DicomFrame first = file.frames.front();
  const std::string table = text_of(set.GetDataElement(Tag(0x3004, 0x000c)));
  std::vector<double> offsets;
  std::istringstream words(table);
  for (std::string word; std::getline(words, word, '\\');) {
    if (const auto number = written_number(word)) offsets.push_back(number->value);
  }
  const bool by_table = !table.empty();
  if (by_table && offsets.size() != file.frames.size()) {
    throw Unfit{std::to_string(file.frames.size()) + " frames and " +
                    std::to_string(offsets.size()) + " numbers in GridFrameOffsetVector",
                "export it again"};
  }
  const double distance = first.distance_mm.value_or(0);
  if (!by_table && distance < 0) {
    throw Unfit{"SpacingBetweenSlices " + number_text(distance) +
                    " is negative, and its frames have no position",
                "export it again, with the position of each frame"};
  }
  file.remark = "frames in the order of the file, which has no position of each";
  const bool known = (by_table || distance > 0) && first.position_mm && first.orientation;
  for (DicomFrame& frame : file.frames) {
    const auto at = static_cast<double>(frame.index);
    frame.number = at;
    frame.location_mm.reset();
    if (!known) {
      frame.position_mm.reset();
      continue;
    }
    const auto& o = *first.orientation;
    const double depth = by_table ? offsets[frame.index] - offsets[0] : at * distance;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
      (*frame.position_mm)[i].value +=
          depth * (o[j].value * o[3 + k].value - o[k].value * o[3 + j].value);
    }
  }
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

/// What the user should know of the units of the values.
void describe_values(const Facts& facts, const std::string& modality, DicomFile& file) {
  std::string type = facts.text(kTransformation, Tag(0x0028, 0x1054));
  if (const auto lut = facts.group(Tag(0x0028, 0x3000))) {
    type = text_of(lut->GetDataElement(Tag(0x0028, 0x3004)));
  }
  // C.11.1.1.2: HU, if no other type is named.
  file.in_hounsfield = type == "HU" || (type.empty() && modality == "CT");
  const auto add = [&](const std::string& text) {
    file.remark += (file.remark.empty() ? "" : "; ") + text;
  };
  if (!type.empty() && type != "HU") add("its values are in " + one_line(type) + ", not in HU");
  const bool plain = file.frames.front().transform == ModalityTransform{};
  if (plain && facts.group(Tag(0x0040, 0x9096))) {
    add("values as stored: its Real World Value Mapping is not applied");
  }
}

/// Fills in the frames of a file whose header is read, or throws Unfit.
void read_frames(const gdcm::Reader& reader, std::uint64_t file_bytes, std::ifstream& in,
                 DicomFile& file) {
  const gdcm::DataSet& set = reader.GetFile().GetDataSet();
  file.pixels = pixels_of(set);
  const std::size_t count = frame_count(set);
  std::optional<gdcm::DataSet> shared = item(set, kSharedGroups, 0);
  gdcm::SmartPointer<gdcm::SequenceOfItems> own;
  if (set.FindDataElement(kFrameGroups)) own = set.GetDataElement(kFrameGroups).GetValueAsSQ();
  if (own && own->GetNumberOfItems() != count) {
    throw Unfit{std::to_string(count) + " frames, and the facts of " +
                    std::to_string(own->GetNumberOfItems()),
                "export it again"};
  }
  locate_pixels(reader, file_bytes, count, in, file.pixels);
  const gdcm::DataSet* all = shared ? &*shared : nullptr;
  const auto facts_of = [&](std::size_t i) {
    return Facts(own ? &own->GetItem(i + 1).GetNestedDataSet() : nullptr, all, &set);
  };
  if (own) {
    for (std::size_t i = 0; i < count; ++i) {
      file.frames.push_back(frame_of(facts_of(i), i, file.pixels));
      const auto in_stack =
          binary<std::uint32_t>(facts_of(i).find(kFrameContent, Tag(0x0020, 0x9057)));
      file.frames.back().number = static_cast<double>(in_stack.value_or(i));
    }
  } else {
    const DicomFrame first = frame_of(Facts(nullptr, all, &set), 0, file.pixels);
    file.frames.assign(count, first);
    for (std::size_t i = 0; i < count; ++i) file.frames[i].index = i;
    if (count > 1) place_frames(set, file);
    const auto number = written_number(text_of(set.GetDataElement(Tag(0x0020, 0x0013))));
    if (count == 1 && number) file.frames[0].number = number->value;
  }
  describe_values(facts_of(0), text_of(set.GetDataElement(Tag(0x0008, 0x0060))), file);
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

/// The series of a file that GDCM cannot parse: what follows the first such tag; or empty.
std::string series_in(std::string_view bytes) {
  using namespace std::string_view_literals;
  for (const std::string_view element : {"\x20\x00\x0e\x00UI"sv, "\x20\x00\x0e\x00"sv}) {
    const std::size_t at = bytes.find(element);
    if (at == bytes.npos || at + 8 > bytes.size()) continue;
    const std::size_t length_at = at + (element.size() == 6 ? 6 : 4);
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
    const std::size_t length = byte(length_at) + std::size_t{256} * byte(length_at + 1);
    constexpr std::size_t kLongestUid = 64;
    if (length <= kLongestUid) return trimmed(bytes.substr(at + 8, length));
  }
  return {};
}

/// If the file names an encoding that GDCM does not know: its UID; `bytes` names another one then,
/// so that the header can be read, which is in explicit little endian for all (PS3.5 A.4).
std::optional<std::string> replace_syntax(std::string& bytes) {
  using namespace std::string_view_literals;
  constexpr std::string_view kElement = "\x02\x00\x10\x00UI"sv;
  constexpr std::string_view kKnown = "1.2.840.10008.1.2.1"sv;
  constexpr std::size_t kMetaBytes = 4096;
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

void describe(const gdcm::DataSet& set, DicomFile& file) {
  const auto text = [&](std::uint16_t group, std::uint16_t element) {
    return text_of(set.GetDataElement(Tag(group, element)));
  };
  file.series = text(0x0020, 0x000e);
  file.series_name = text(0x0008, 0x103e);
  file.series_number = number_in(text(0x0020, 0x0011)).value_or(0);
  // A slice has a grey value per pixel, or a position.
  const auto samples = binary<std::uint16_t>(set.GetDataElement(Tag(0x0028, 0x0002)));
  file.is_slice = set.FindDataElement(Tag(0x0020, 0x0032)) || set.FindDataElement(kFrameGroups) ||
                  (set.FindDataElement(Tag(0x0028, 0x0010)) && samples.value_or(1) == 1);
}

}  // namespace

std::optional<DicomFile> read_dicom_header(const fs::path& path) {
  DicomFile file;
  file.path = path;
  std::ifstream in(path, std::ios::binary);
  std::array<char, 132> head{};
  in.read(head.data(), head.size());
  const bool magic = in && std::string_view(head.data() + 128, 4) == "DICM";
  std::error_code fault;
  const std::uint64_t file_bytes = fs::file_size(path, fault);
  try {
    gdcm::Reader reader;
    reader.SetFileName(path.c_str());
    if (!reader.CanRead()) return std::nullopt;
    if (read_up_to_pixels(reader)) {
      describe(reader.GetFile().GetDataSet(), file);
      read_frames(reader, file_bytes, in, file);
      return file;
    }
    in.clear();
    in.seekg(0);
    std::ostringstream all;
    all << in.rdbuf();
    std::string bytes = std::move(all).str();
    file.series = series_in(bytes);
    if (!magic && file.series.empty()) return std::nullopt;  // looked like one, as any file may
    const auto syntax = replace_syntax(bytes);
    std::istringstream stream(std::move(bytes));
    gdcm::Reader again;
    again.SetStream(stream);
    if (syntax && read_up_to_pixels(again)) {
      describe(again.GetFile().GetDataSet(), file);
      refuse_syntax(*syntax);
    }
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
