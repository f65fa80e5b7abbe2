// SPDX-License-Identifier: Apache-2.0
// MetaImage as MetaIO reads it: fields, data files, and the position of each voxel in LPS.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/header_fields.hpp"
#include "controller/volume/file/voxel_files.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "shared/text/text.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;
namespace {

constexpr const char* kData = "ElementDataFile";

/// A header, the names that follow `ElementDataFile = LIST`, and where it ends.
struct MetaHeader {
  HeaderFields fields;
  std::vector<std::string> names;
  std::uint64_t end = 0;
};

/// The keys that count here. Others, such as Comment, may be there twice.
constexpr std::string_view kMetaKeys[] = {"ObjectType",
                                          "NDims",
                                          "DimSize",
                                          "ElementType",
                                          kData,
                                          "HeaderSize",
                                          "BinaryData",
                                          "CompressedData",
                                          "CompressedDataSize",
                                          "ElementByteOrderMSB",
                                          "BinaryDataByteOrderMSB",
                                          "ElementSpacing",
                                          "ElementSize",
                                          "DistanceUnits",
                                          "Offset",
                                          "Position",
                                          "Origin",
                                          "ImagePosition",
                                          "ElementOrigin",
                                          "TransformMatrix",
                                          "Rotation",
                                          "Orientation",
                                          "ElementDirection",
                                          "CenterOfRotation",
                                          "AnatomicalOrientation",
                                          "ElementNumberOfChannels",
                                          "ElementToIntensityFunctionSlope",
                                          "ElementToIntensityFunctionOffset"};

/// Lines of `key = text` up to ElementDataFile; others are ignored, as MetaIO does.
MetaHeader meta_header(const fs::path& path) {
  HeaderLines lines(path);
  MetaHeader header{HeaderFields(path), {}, 0};
  for (auto line = lines.next(); line; line = lines.next()) {
    const std::size_t at = line->find('=');
    if (at == std::string::npos) continue;
    const std::string key = lower(stripped(std::string_view(*line).substr(0, at)));
    const auto known = std::ranges::find_if(
        kMetaKeys, [&](std::string_view name) { return lower(std::string(name)) == key; });
    if (known == std::end(kMetaKeys)) continue;
    header.fields.add(*known, stripped(std::string_view(*line).substr(at + 1)));
    if (*known == kData) break;
  }
  header.end = lines.end();
  const HeaderFields& fields = header.fields;
  if (fields.text("DimSize").empty() || fields.text(kData).empty()) {
    throw LoadError(path.string() + ": no MetaImage header (`DimSize` or `ElementDataFile` is " +
                    "missing); is it another format?");
  }
  if (fields.text(kData).starts_with("LIST")) {
    while (const auto line = lines.next()) header.names.push_back(stripped(*line));
    std::erase(header.names, "");
  }
  return header;
}

VoxelType meta_type(const HeaderFields& fields) {
  constexpr std::pair<std::string_view, VoxelType> kTypes[] = {
      {"met_char", VoxelType::int8},       {"met_uchar", VoxelType::uint8},
      {"met_short", VoxelType::int16},     {"met_ushort", VoxelType::uint16},
      {"met_int", VoxelType::int32},       {"met_uint", VoxelType::uint32},
      {"met_long", VoxelType::int32},      {"met_ulong", VoxelType::uint32},  // 4 bytes always
      {"met_long_long", VoxelType::int64}, {"met_ulong_long", VoxelType::uint64},
      {"met_float", VoxelType::float32},   {"met_double", VoxelType::float64}};
  const std::string word = lower(fields.needed("ElementType"));
  for (const auto& [name, type] : kTypes) {
    if (name == word) return type;
  }
  fields.refuse("ElementType", "is not a type of numbers, such as MET_SHORT; correct the header");
}

bool is_true(const HeaderFields& fields, const char* key, bool otherwise) {
  if (!fields.has(key)) return otherwise;
  const std::string word = lower(fields.text(key));
  if (word == "true" || word == "t" || word == "1") return true;
  if (word == "false" || word == "f" || word == "0") return false;
  fields.refuse(key, "is neither True nor False; correct the header");
}

/// The numbers under one of several keys that mean the same; refuses keys that differ.
std::vector<Written> one_meaning(const HeaderFields& fields, const std::vector<const char*>& keys,
                                 std::size_t count) {
  std::vector<Written> found;
  const char* first = nullptr;
  for (const char* key : keys) {
    if (!fields.has(key)) continue;
    const std::vector<Written> numbers = fields.numbers(key, count);
    if (first != nullptr &&
        !std::ranges::equal(numbers, found, {}, &Written::value, &Written::value)) {
      fields.refuse(key,
                    std::string("contradicts `") + first + "`, which means the same; keep one");
    }
    found = numbers;
    first = key;
  }
  return found;
}

/// The three axes of the volume; the others have one layer each.
std::vector<std::size_t> meta_axes(const fs::path& path, const std::vector<std::int64_t>& sizes) {
  std::vector<std::size_t> axes;
  for (std::size_t axis = 0; axis < sizes.size(); ++axis) axes.push_back(axis);
  for (std::size_t i = axes.size(); i-- > 0 && axes.size() > 3;) {
    if (sizes[i] == 1) axes.erase(axes.begin() + static_cast<std::ptrdiff_t>(i));
  }
  if (axes.size() == 3) return axes;
  throw LoadError(path.string() + ": " + std::to_string(sizes.size()) +
                  " axes; kerf needs a volume of three");
}

/// AnatomicalOrientation names, for each axis, the side of the patient from which it goes (ITK,
/// which writes RAI for the axes of LPS), or to which it goes (MetaIO's page: LPS). The matrix
/// counts; letters that fit it in neither meaning are a contradiction.
void check_letters(const HeaderFields& fields, const UntrustedHeader& claim) {
  constexpr const char* kKey = "AnatomicalOrientation";
  const std::string letters = lower(fields.text(kKey));
  bool goes_from = true, goes_to = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (axis >= letters.size() || letters[axis] == '?') continue;  // not known
    constexpr std::string_view kFrom = "railps";  // from the right to the left is +x in LPS
    const std::size_t at = kFrom.find(letters[axis]);
    if (at == std::string_view::npos)
      fields.refuse(kKey, "is not three of R L A P I S; correct the header");
    const double along = (at < 3 ? 1 : -1) * claim.axes[axis][at % 3];
    goes_from = goes_from && along > 0;
    goes_to = goes_to && along < 0;
  }
  if (goes_from || goes_to) return;
  fields.refuse(kKey, fields.has("TransformMatrix")
                          ? "contradicts `TransformMatrix`; correct one of them"
                          : "without a `TransformMatrix`; add the matrix, row by row the direction "
                            "of an axis in LPS");
}

UntrustedHeader meta_claim(const HeaderFields& fields, const std::vector<std::int64_t>& sizes) {
  const std::size_t count = sizes.size();
  const std::vector<std::size_t> axes = meta_axes(fields.path(), sizes);
  const std::vector<Written> matrix = one_meaning(
      fields, {"TransformMatrix", "Rotation", "Orientation", "ElementDirection"}, count * count);
  const std::vector<Written> origin = one_meaning(
      fields, {"Offset", "Position", "Origin", "ImagePosition", "ElementOrigin"}, count);
  // ElementSize is that of a voxel, which may leave gaps, so it counts only alone, as in MetaIO.
  const std::vector<Written> spacing =
      one_meaning(fields, {fields.has("ElementSpacing") ? "ElementSpacing" : "ElementSize"}, count);
  const auto unit = length_unit(fields.text("DistanceUnits"));
  if (!unit) fields.refuse("DistanceUnits", "is no length that kerf reads; write lengths in mm");
  UntrustedHeader claim;
  claim.spacing_known = spacing.empty() ? 0 : 7;
  claim.axes_known = matrix.empty() && !fields.has("AnatomicalOrientation") ? 0 : 1;
  for (std::size_t i = 0; i < 3; ++i) {
    claim.size[i] = sizes[axes[i]];
    if (!spacing.empty()) claim.spacing_mm[i] = spacing[axes[i]].value * unit->times / unit->over;
    if (!origin.empty()) claim.origin_mm[i] = origin[axes[i]].value * unit->times / unit->over;
    claim.axes[i] = {};
    claim.axes[i][i] = 1;
    for (std::size_t j = 0; !matrix.empty() && j < count; ++j) {
      const double value = matrix[axes[i] * count + j].value;
      const auto kept = std::ranges::find(axes, j);
      if (kept != axes.end()) {
        claim.axes[i][static_cast<std::size_t>(kept - axes.begin())] = value;
      } else if (value != 0) {
        fields.refuse("TransformMatrix", "turns an axis out of space; correct it");
      }
    }
  }
  return claim;
}

/// Refuses what a reader may apply or not: MetaIO and ITK read the values as they are stored, and
/// turn about the first voxel.
void check_rest(const HeaderFields& fields, const UntrustedHeader& claim) {
  const auto differs = [&](const char* key, std::size_t count, double usual) {
    if (!fields.has(key)) return false;
    return !std::ranges::all_of(fields.numbers(key, count),
                                [&](const Written& number) { return number.value == usual; });
  };
  for (const auto& [key, usual] : {std::pair{"ElementToIntensityFunctionSlope", 1.0},
                                   std::pair{"ElementToIntensityFunctionOffset", 0.0}}) {
    if (!differs(key, 1, usual)) continue;
    fields.refuse(key, "may be applied already or not; apply it to the voxels and remove the line");
  }
  if (differs("ElementNumberOfChannels", 1, 1)) {
    fields.refuse("ElementNumberOfChannels",
                  "values per voxel; save it as one grey value per voxel");
  }
  const std::array<vec3::Vec, 3> straight{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  const auto count = static_cast<std::size_t>(fields.whole_numbers("NDims", 1)[0]);
  if (differs("CenterOfRotation", count, 0) && claim.axes != straight) {
    fields.refuse("CenterOfRotation",
                  "moves the volume in some readers; write the Offset of the "
                  "first voxel, and a centre of 0 0 0");
  }
  const std::string object = lower(fields.text("ObjectType"));
  if (!object.empty() && object != "image")
    fields.refuse("ObjectType", "is not Image; name an image");
}

/// `LOCAL`, a name, `LIST [axes]`, or `PATTERN [min max step]` with a file for each last layer.
std::vector<VoxelPart> meta_parts(const MetaHeader& header,
                                  const std::vector<std::int64_t>& sizes) {
  const HeaderFields& fields = header.fields;
  const std::string text = fields.text(kData);
  std::vector<VoxelPart> parts;
  FileNames names(text, 3);
  std::vector<std::int64_t>& numbers = names.numbers;
  if (lower(text) == "local") {
    parts.push_back({fields.path(), header.end});
  } else if (names.is_list() || names.is_pattern()) {
    if (names.is_pattern()) {  // by default from 1, in steps of 1, a file for each last layer
      if (numbers.empty()) numbers = {1};
      if (numbers.size() == 1) numbers.push_back(numbers[0] + sizes.back() - 1);
      if (numbers.size() == 2) numbers.push_back(1);
    }
    for (const fs::path& file : files_of(fields, kData, names, header.names, sizes)) {
      parts.push_back({file});
    }
  } else {
    parts.push_back({fields.path().parent_path() / text});
  }
  for (const VoxelPart& part : parts) {
    if (part.begin == 0) refuse_itself(fields, kData, part.file, "write LOCAL");
  }
  const std::int64_t skip = fields.whole_number_or("HeaderSize", 0);
  const bool inside = skip > 0 && parts.front().begin > static_cast<std::uint64_t>(skip);
  if (skip < -1 || inside) {
    fields.refuse("HeaderSize", "is not the number of bytes before the voxels; correct it");
  }
  for (VoxelPart& part : parts) {
    if (skip > 0) part.begin = static_cast<std::uint64_t>(skip);
    part.bytes = std::min<std::int64_t>(skip, 0);
  }
  return parts;
}

}  // namespace

void read_meta(const fs::path& path, const MemoryRequest& offer) {
  const MetaHeader header = meta_header(path);
  const HeaderFields& fields = header.fields;
  constexpr std::int64_t kMostAxes = 10;  // as in MetaIO
  const std::int64_t dimension = fields.whole_numbers("NDims", 1)[0];
  if (dimension < 1 || dimension > kMostAxes) {
    fields.refuse("NDims", "is not a number of axes; correct the header");
  }
  const auto sizes = fields.whole_numbers("DimSize", static_cast<std::size_t>(dimension));
  const UntrustedHeader claim = meta_claim(fields, sizes);
  check_grid(path.string(), claim.size[0], claim.size[1], claim.size[2]);
  check_letters(fields, claim);
  check_rest(fields, claim);
  VoxelFiles files;
  files.type = meta_type(fields);
  const bool is_binary = is_true(fields, "BinaryData", true);
  if (!is_binary) {
    files.packing = Packing::text;
  } else if (is_true(fields, "CompressedData", false)) {
    files.packing = Packing::deflated;
  }
  const bool big = is_true(fields, "ElementByteOrderMSB", false);
  files.big_endian = is_true(fields, "BinaryDataByteOrderMSB", big);
  if (fields.has("ElementByteOrderMSB") && big != files.big_endian) {
    fields.refuse("ElementByteOrderMSB", "contradicts `BinaryDataByteOrderMSB`; keep one");
  }
  const std::int64_t packed = fields.whole_number_or("CompressedDataSize", 0);
  if (packed > 0 && files.packing == Packing::deflated) {
    files.packed_bytes = static_cast<std::uint64_t>(packed);
  }
  files.parts = meta_parts(header, sizes);
  if (files.packing != Packing::raw && files.parts.front().bytes < 0) {
    fields.refuse("HeaderSize", "counts from the end, which only raw voxels allow; save it as raw");
  }
  read_voxel_files(path, files, claim, offer);
}

}  // namespace kerf::volume
