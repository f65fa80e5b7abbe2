// SPDX-License-Identifier: Apache-2.0
// Position, transform and marks of each frame of a DICOM file.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <sstream>
#include <utility>

#include "controller/volume/file/dicom_elements.hpp"
#include "shared/numeric/elementary.hpp"

namespace kerf::volume {
using gdcm::Tag;

double rounding_of(int decimals) noexcept {
  return decimals > 0 ? 0.5 * power_of_tenth(decimals) : 0;
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

namespace {

const Tag kNoGroup(0, 0);
const Tag kSharedGroups(0x5200, 0x9229), kFrameGroups(0x5200, 0x9230);
const Tag kFrameContent(0x0020, 0x9111), kMeasures(0x0028, 0x9110);
const Tag kTransformation(0x0028, 0x9145);

/// What may differ between two volumes of one series, the surest first.
struct Mark {
  const char* name;
  Tag group, tag;
  enum class As : std::uint8_t { text, u16, u32, f32, f64 } as;
};
const Mark kMarks[] = {
    {"PatientID", kNoGroup, Tag(0x0010, 0x0020), Mark::As::text},
    {"StudyInstanceUID", kNoGroup, Tag(0x0020, 0x000d), Mark::As::text},
    {"FrameOfReferenceUID", kNoGroup, Tag(0x0020, 0x0052), Mark::As::text},
    {"TemporalPositionIndex", kFrameContent, Tag(0x0020, 0x9128), Mark::As::u32},
    {"TemporalPositionIdentifier", kNoGroup, Tag(0x0020, 0x0100), Mark::As::text},
    {"EchoNumbers", kNoGroup, Tag(0x0018, 0x0086), Mark::As::text},
    {"EffectiveEchoTime", Tag(0x0018, 0x9114), Tag(0x0018, 0x9082), Mark::As::f64},
    {"ReferencedSegmentNumber", Tag(0x0062, 0x000a), Tag(0x0062, 0x000b), Mark::As::u16},
    {"DiffusionBValue", Tag(0x0018, 0x9117), Tag(0x0018, 0x9087), Mark::As::f64},
    {kStackMark, kFrameContent, Tag(0x0020, 0x9056), Mark::As::text},
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

std::string mark_text(const gdcm::DataElement& element, Mark::As as) {
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
    std::string text = mark_text(facts.find(mark.group, mark.tag), mark.as);
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
  if (const gdcm::DataSet* set = facts.group(Tag(0x0028, 0x3000))) {
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
  if (!frame.spacing_mm) frame.bad_spacing = facts.text(kMeasures, Tag(0x0028, 0x0030));
  if (const auto distance = written_number(facts.text(kMeasures, Tag(0x0018, 0x0088)))) {
    frame.distance_mm = distance->value;
  }
  frame.location_mm = written_number(facts.text(kNoGroup, Tag(0x0020, 0x1041)));
  frame.transform = transform_of(facts, pixels.is_signed);
  frame.marks = marks_of(facts);
  return frame;
}

const Tag kOffsets(0x3004, 0x000c), kSliceVector(0x0054, 0x0080);

/// Refuses frames that follow one another in time or by views, not through a body: the tag that
/// counts them says so. Refuses one that is not in the file, too.
void refuse_no_slices(const gdcm::DataSet& set) {
  const gdcm::DataElement& pointers = set.GetDataElement(Tag(0x0028, 0x0009));
  for (std::size_t i = 0; const auto group = binary<std::uint16_t>(pointers, i); i += 2) {
    const Tag tag(*group, binary<std::uint16_t>(pointers, i + 1).value_or(0));
    std::array<char, 16> text{};
    std::snprintf(text.data(), text.size(), "(%04x,%04x)", tag.GetGroup(), tag.GetElement());
    const std::string counted = std::string("its frames are counted by ") + text.data();
    if (tag != kOffsets && tag != kSliceVector) {
      throw Unfit{counted + ", a time, view or page, and are no slices",
                  "name a file or folder of slices"};
    }
    if (bytes_of(set.GetDataElement(tag)).empty()) {
      throw Unfit{counted + ", which is not in the file", "export it again"};
    }
  }
}

/// Numbers of the frames from 0, in the order through the body: those of a SliceVector (PS3.3
/// C.8.4.8.1), which begin at 1; else the order of the file.
std::vector<std::size_t> slice_numbers(const gdcm::DataSet& set, std::size_t count) {
  const gdcm::DataElement& vector = set.GetDataElement(kSliceVector);
  std::vector<std::size_t> numbers(count);
  for (std::size_t i = 0; i < count; ++i) numbers[i] = i;
  if (bytes_of(vector).empty()) return numbers;
  std::vector<bool> taken(count, false);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t own = binary<std::uint16_t>(vector, i).value_or(0);
    if (own == 0 || own > count || taken[own - 1]) {
      throw Unfit{
          "SliceVector does not number its " + std::to_string(count) + " frames from 1, each once",
          "export it again, one volume in a file"};
    }
    taken[own - 1] = true;
    numbers[i] = own - 1;
  }
  return numbers;
}

/// Positions of the frames of a file without functional groups: they follow one another in the
/// order of a SliceVector or of the file, by a table (RT dose, PS3.3 C.8.8.3.2) or by one distance.
void place_frames(const gdcm::DataSet& set, DicomFile& file) {
  refuse_no_slices(set);
  const DicomFrame first = file.frames.front();
  const std::string table = text_of(set.GetDataElement(kOffsets));
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
  const std::vector<std::size_t> numbers = slice_numbers(set, file.frames.size());
  const bool by_vector = !bytes_of(set.GetDataElement(kSliceVector)).empty();
  if (by_table && by_vector) {
    throw Unfit{"has a SliceVector and a GridFrameOffsetVector", "leave one of them out"};
  }
  file.remark = std::string("frames in the order of ") + (by_vector ? "SliceVector" : "the file") +
                ", which has no position of each";
  const bool known = (by_table || distance > 0) && first.position_mm && first.orientation;
  for (DicomFrame& frame : file.frames) {
    const auto at = static_cast<double>(numbers[frame.index]);
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

/// What the user should know of the units of the values.
void describe_values(const Facts& facts, const std::string& modality, DicomFile& file) {
  std::string type = facts.text(kTransformation, Tag(0x0028, 0x1054));
  if (const gdcm::DataSet* lut = facts.group(Tag(0x0028, 0x3000))) {
    type = text_of(lut->GetDataElement(Tag(0x0028, 0x3004)));
  }
  // C.11.1.1.2: HU, if no other type is named.
  file.in_hounsfield = type == "HU" || (type.empty() && modality == "CT");
  const auto add = [&](const std::string& text) {
    file.remark += (file.remark.empty() ? "" : "; ") + text;
  };
  if (!type.empty() && type != "HU") add("its values are in " + one_line(type) + ", not in HU");
  const bool plain = file.frames.front().transform == ModalityTransform{};
  if (plain && facts.group(Tag(0x0040, 0x9096)) != nullptr) {
    add("values as stored: its Real World Value Mapping is not applied");
  }
}

}  // namespace

void read_frames(const gdcm::DataSet& set, std::size_t count, DicomFile& file) {
  if (set.FindDataElement(Tag(0x3004, 0x000e))) {  // DoseGridScaling, PS3.3 C.8.8.3
    throw Unfit{"is a dose, in steps of DoseGridScaling", "convert it to NRRD in its own unit"};
  }
  std::optional<gdcm::DataSet> shared = item(set, kSharedGroups, 0);
  gdcm::SmartPointer<gdcm::SequenceOfItems> own;
  if (set.FindDataElement(kFrameGroups)) own = set.GetDataElement(kFrameGroups).GetValueAsSQ();
  if (own && own->GetNumberOfItems() != count) {
    throw Unfit{std::to_string(count) + " frames, and the facts of " +
                    std::to_string(own->GetNumberOfItems()),
                "export it again"};
  }
  const Groups all(shared ? &*shared : nullptr), top(&set);
  const auto facts_of = [&](std::size_t i) {
    return Facts(own ? &own->GetItem(i + 1).GetNestedDataSet() : nullptr, all, top);
  };
  if (own) {
    for (std::size_t i = 0; i < count; ++i) {
      const Facts facts = facts_of(i);
      file.frames.push_back(frame_of(facts, i, file.pixels));
      const auto in_stack = binary<std::uint32_t>(facts.find(kFrameContent, Tag(0x0020, 0x9057)));
      if (in_stack) file.frames.back().number = static_cast<double>(*in_stack);
      file.frames.back().marks.emplace_back("file", file.path.filename().string());
    }
  } else {
    const DicomFrame first = frame_of(facts_of(0), 0, file.pixels);
    file.frames.assign(count, first);
    for (std::size_t i = 0; i < count; ++i) file.frames[i].index = i;
    if (count > 1) place_frames(set, file);
    const auto number = written_number(text_of(set.GetDataElement(Tag(0x0020, 0x0013))));
    if (count == 1 && number) file.frames[0].number = number->value;
  }
  describe_values(facts_of(0), text_of(set.GetDataElement(Tag(0x0008, 0x0060))), file);
}

}  // namespace kerf::volume
