// SPDX-License-Identifier: Apache-2.0
// NRRD as its definition has it (teem.sourceforge.net/nrrd/format.html): fields and data files.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/header_fields.hpp"
#include "controller/volume/file/voxel_files.hpp"
#include "shared/text/text.hpp"

namespace kerf::volume {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kNrrdFields[] = {"content",
                                            "number",
                                            "type",
                                            "block size",
                                            "dimension",
                                            "space",
                                            "space dimension",
                                            "sizes",
                                            "spacings",
                                            "thicknesses",
                                            "axis mins",
                                            "axis maxs",
                                            "space directions",
                                            "centers",
                                            "kinds",
                                            "labels",
                                            "units",
                                            "min",
                                            "max",
                                            "old min",
                                            "old max",
                                            "endian",
                                            "encoding",
                                            "line skip",
                                            "byte skip",
                                            "sample units",
                                            "space units",
                                            "space origin",
                                            "measurement frame",
                                            "data file"};

/// The field that a key names; empty for none.
std::string_view field_of(std::string_view key) {
  const std::string name = squeezed(key);
  if (name == "centerings") return "centers";
  const auto found = std::ranges::find_if(
      kNrrdFields, [&](std::string_view field) { return squeezed(field) == name; });
  return found == std::end(kNrrdFields) ? std::string_view{} : *found;
}

/// A header, the names that follow `data file: LIST`, and where it ends.
struct NrrdHeader {
  HeaderFields fields;
  std::vector<std::string> names;
  std::uint64_t end = 0;
};

/// 5.1: a line is a comment, a field `name: text`, or a pair `key:=text`, which is no field
/// whatever its key. An empty line ends the header.
NrrdHeader nrrd_header(const fs::path& path) {
  HeaderLines lines(path);
  NrrdHeader header{HeaderFields(path), {}, 0};
  const std::string magic = stripped(lines.next().value_or(""));
  constexpr std::string_view kMagics =
      "|NRRD00.01|NRRD0001|NRRD0002|NRRD0003|NRRD0004|NRRD0005|NRRD0006|";
  if (!magic.starts_with("NRRD") || kMagics.find("|" + magic + "|") == std::string_view::npos) {
    throw LoadError(path.string() +
                    ": no NRRD header (its first line is not NRRD0001 .. NRRD0006)" +
                    "; is it another format?");
  }
  bool lists_names = false;
  for (auto line = lines.next(); line && !stripped(*line).empty(); line = lines.next()) {
    if (lists_names) {
      header.names.push_back(stripped(*line));
      continue;
    }
    const std::size_t colon = line->find(':');
    const bool is_pair = line->find(":=") != std::string::npos;
    if (line->front() == '#' || (is_pair && line->find(":=") == colon)) continue;
    const std::string_view field = field_of(std::string_view(*line).substr(0, colon));
    if (field.empty() && is_pair) continue;
    if (colon == std::string::npos || field.empty()) {
      throw LoadError(path.string() + ": the header's line '" + one_line(line->substr(0, 80)) +
                      "' is no field of NRRD; correct the header (a pair is written key:=value)");
    }
    const std::string text = stripped(std::string_view(*line).substr(colon + 1));
    header.fields.add(field, text);
    lists_names = field == "data file" && FileNames(text, 1).is_list();
  }
  header.end = lines.end();
  return header;
}

VoxelType nrrd_type(const HeaderFields& fields) {
  constexpr std::pair<std::string_view, VoxelType> kTypes[] = {
      {"|signedchar|int8|int8_t|", VoxelType::int8},
      {"|uchar|unsignedchar|uint8|uint8_t|", VoxelType::uint8},
      {"|short|shortint|signedshort|signedshortint|int16|int16_t|", VoxelType::int16},
      {"|ushort|unsignedshort|unsignedshortint|uint16|uint16_t|", VoxelType::uint16},
      {"|int|signedint|int32|int32_t|", VoxelType::int32},
      {"|uint|unsignedint|uint32|uint32_t|", VoxelType::uint32},
      {"|longlong|longlongint|signedlonglong|signedlonglongint|int64|int64_t|", VoxelType::int64},
      {"|ulonglong|unsignedlonglong|unsignedlonglongint|uint64|uint64_t|", VoxelType::uint64},
      {"|float|", VoxelType::float32},
      {"|double|", VoxelType::float64}};
  const std::string word = "|" + squeezed(fields.needed("type")) + "|";
  for (const auto& [words, type] : kTypes) {
    if (words.find(word) != std::string_view::npos) return type;
  }
  fields.refuse("type", "is not a type of numbers, such as uint16 or float; correct the header");
}

Packing packing_of(const HeaderFields& fields) {
  const std::string word = lower(fields.needed("encoding"));
  if (word == "raw") return Packing::raw;
  if (word == "txt" || word == "text" || word == "ascii") return Packing::text;
  if (word == "hex") return Packing::hex;
  if (word == "gz" || word == "gzip") return Packing::deflated;
  if (word == "bz2" || word == "bzip2") return Packing::bzip2;
  fields.refuse("encoding", "is not one of raw, text, hex, gzip, bzip2; correct the header");
}

/// 5: `data file: NAME`, `PATTERN min max step [axes]`, `LIST [axes]` or `SKIPLIST [axes]`.
std::vector<VoxelPart> nrrd_parts(const NrrdHeader& header,
                                  const std::vector<std::int64_t>& sizes) {
  const HeaderFields& fields = header.fields;
  constexpr const char* kKey = "data file";
  const FileNames names(fields.text(kKey), 4);
  std::vector<std::string> list = header.names;
  std::vector<std::int64_t> skips(list.size());
  for (std::size_t i = 0; names.pattern == "SKIPLIST" && i < list.size(); ++i) {
    const std::size_t blank = std::min(list[i].find(' '), list[i].size());
    const auto skip = whole_number(list[i].substr(0, blank));
    list[i] = stripped(list[i].substr(blank));
    if (!skip || *skip < 0 || list[i].empty() || fields.has("byte skip")) {
      fields.refuse(kKey, "needs a number of bytes and a name in each line; correct the header");
    }
    skips[i] = *skip;
  }
  std::vector<VoxelPart> parts;
  if (names.is_list() || names.is_pattern()) {
    for (const fs::path& file : files_of(fields, kKey, names, list, sizes)) parts.push_back({file});
    for (std::size_t i = 0; i < skips.size(); ++i) parts[i].bytes = skips[i];
  } else if (fields.has(kKey)) {
    parts.push_back({fields.path().parent_path() / fields.needed(kKey)});
  } else {
    parts.push_back({fields.path(), header.end});
  }
  for (const VoxelPart& part : parts) {
    if (fields.has(kKey)) refuse_itself(fields, kKey, part.file, "leave the line out");
  }
  const std::int64_t lines = fields.whole_number_or("line skip", 0);
  const std::int64_t bytes = fields.whole_number_or("byte skip", 0);
  if (lines < 0) fields.refuse("line skip", "is negative; correct the header");
  if (bytes < 0 && packing_of(fields) != Packing::raw) {
    fields.refuse("byte skip", "counts from the end, which only raw voxels allow; save it as raw");
  }
  for (VoxelPart& part : parts) {
    part.lines = static_cast<std::uint64_t>(lines);
    part.bytes += bytes;
  }
  return parts;
}

}  // namespace

void read_nrrd(const fs::path& path, const MemoryRequest& offer) {
  const NrrdHeader header = nrrd_header(path);
  const HeaderFields& fields = header.fields;
  constexpr std::int64_t kMostAxes = 16;  // NRRD_DIM_MAX of its library
  const std::int64_t dimension = fields.whole_numbers("dimension", 1)[0];
  if (dimension < 1 || dimension > kMostAxes) {
    fields.refuse("dimension", "is not a number of axes; correct the header");
  }
  const auto sizes = fields.whole_numbers("sizes", static_cast<std::size_t>(dimension));
  VoxelFiles files;
  files.type = nrrd_type(fields);
  files.packing = packing_of(fields);
  const UntrustedHeader claim = nrrd_claim(fields, sizes);
  check_grid(path.string(), claim.size[0], claim.size[1], claim.size[2]);
  const std::string endian = lower(fields.text("endian"));
  const bool matters = files.packing != Packing::text && bytes_of(files.type) > 1;
  if ((matters || !endian.empty()) && endian != "little" && endian != "big") {
    fields.refuse("endian", "is neither little nor big; correct the header");
  }
  files.big_endian = endian == "big";
  files.parts = nrrd_parts(header, sizes);
  read_voxel_files(path, files, claim, offer);
}

}  // namespace kerf::volume
