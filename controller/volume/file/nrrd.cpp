// SPDX-License-Identifier: Apache-2.0
// NRRD as its definition has it (teem.sourceforge.net/nrrd/format.html): fields, data files, and
// the position of each voxel in LPS.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iomanip>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/file_headers.hpp"
#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/header_fields.hpp"
#include "controller/volume/file/voxel_files.hpp"
#include "shared/numeric/linear_algebra.hpp"
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

std::string squeezed(std::string_view text, std::string_view without) {
  std::string all = lower(std::string(text));
  std::erase_if(all, [&](char c) { return without.find(c) != std::string_view::npos; });
  return all;
}

/// The field that a key names; empty for none.
std::string_view field_of(std::string_view key) {
  const std::string name = squeezed(key, " \t");
  if (name == "centerings") return "centers";
  const auto found = std::ranges::find_if(
      kNrrdFields, [&](std::string_view field) { return squeezed(field, " ") == name; });
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
  const std::string word = "|" + squeezed(fields.needed("type"), " ") + "|";
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
  if (word == "bz2" || word == "bzip2") {
    fields.refuse("encoding", "cannot be unpacked; save it as gzip or raw");
  }
  fields.refuse("encoding", "is not one of raw, text, hex, gzip; correct the header");
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

/// The coordinates of a header: their number, each one's sign in LPS, whether LPS is known at all.
struct Space {
  std::size_t dimensions = 0;  ///< 0: none are given
  vec3::Vec to_lps{1, 1, 1};
  bool is_patient = false;
};

/// 4: the named spaces, or a number of coordinates without a name.
Space space_of(const HeaderFields& fields) {
  struct Row {
    std::string_view name, shorter;
    vec3::Vec to_lps;
    bool is_patient;
  };
  // The last is mirrored: one axis turned, it is right-handed like all that kerf reads.
  constexpr Row kRows[] = {{"rightanteriorsuperior", "ras", {-1, -1, 1}, true},
                           {"leftanteriorsuperior", "las", {1, -1, 1}, true},
                           {"leftposteriorsuperior", "lps", {1, 1, 1}, true},
                           {"scannerxyz", "scannerxyz", {1, 1, 1}, false},
                           {"3drighthanded", "3drighthanded", {1, 1, 1}, false},
                           {"3dlefthanded", "3dlefthanded", {1, 1, -1}, false}};
  const std::string name = squeezed(fields.text("space"), "- ");
  if (name.empty()) {
    if (!fields.has("space dimension")) return {};
    const std::int64_t count = fields.whole_numbers("space dimension", 1)[0];
    if (count == 3) return {3};
    fields.refuse("space dimension", "is not 3; kerf needs a volume of three axes in space");
  }
  for (const Row& row : kRows) {
    const bool is_timed =
        name == std::string(row.name) + "time" || name == std::string(row.shorter) + "t";
    if (name != row.name && name != row.shorter && !is_timed) continue;
    const Space space{is_timed ? std::size_t{4} : std::size_t{3}, row.to_lps, row.is_patient};
    if (fields.has("space dimension") &&
        fields.whole_numbers("space dimension", 1)[0] != std::int64_t(space.dimensions)) {
      fields.refuse("space dimension", "contradicts `space`; correct the header");
    }
    return space;
  }
  fields.refuse("space",
                "is no space of three axes that NRRD names, such as "
                "left-posterior-superior; correct the header");
}

using Vector = std::optional<std::vector<Written>>;  ///< none: `none`, or NaN in each coordinate

/// `(1,0,0) (0,1,0) none`: `count` vectors of as many coordinates as the space has.
std::vector<Vector> vectors_of(const HeaderFields& fields, const char* key, std::size_t count,
                               std::size_t dimensions) {
  std::vector<Vector> vectors;
  const auto refuse = [&] {
    const std::string one = dimensions == 4 ? "(1,0,0,0)" : "(1,0,0)";
    const std::string all = count == 1 ? "a vector" : std::to_string(count) + " vectors";
    fields.refuse(
        key, "is not " + all + " such as " + one + ", with decimal points; correct the header");
  };
  const std::string text = fields.text(key);
  for (std::size_t at = 0; (at = text.find_first_not_of(" \t", at)) != std::string::npos;) {
    if (text[at] != '(') {
      const std::size_t end = std::min(text.find_first_of(" \t(", at), text.size());
      if (text.substr(at, end - at) != "none") refuse();
      vectors.emplace_back();
      at = end;
      continue;
    }
    const std::size_t end = text.find(')', at);
    if (end == std::string::npos) refuse();
    std::vector<Written> vector;
    std::istringstream words(text.substr(at + 1, end - at - 1));
    for (std::string word; std::getline(words, word, ',');) {
      const auto number = header_number(stripped(word));
      if (!number) refuse();
      vector.push_back(*number);
    }
    const auto nans = static_cast<std::size_t>(std::ranges::count_if(
        vector, [](const Written& number) { return std::isnan(number.value); }));
    if (vector.size() != dimensions || (nans != 0 && nans != dimensions)) refuse();
    vectors.push_back(nans == 0 ? Vector(std::move(vector)) : std::nullopt);
    at = end + 1;
  }
  if (vectors.size() != count) refuse();
  return vectors;
}

/// Units in quotes, `count` of them; mm for a missing field.
std::vector<LengthUnit> units_of(const HeaderFields& fields, const char* key,
                                 const std::vector<std::size_t>& wanted, std::size_t count) {
  std::vector<LengthUnit> units(wanted.size());
  if (!fields.has(key)) return units;
  std::istringstream in(fields.text(key));
  std::vector<std::string> words;
  for (std::string word; in >> std::ws && in.peek() == '"' && in >> std::quoted(word);) {
    words.push_back(word);
  }
  if (words.size() != count || !in.eof()) {
    fields.refuse(key, "is not " + std::to_string(count) +
                           " units in quotes, such as \"mm\" \"mm\" \"mm\"; correct the header");
  }
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const auto unit = length_unit(words[wanted[i]]);
    if (!unit) {
      fields.refuse(key, "is no length that kerf reads; write the header's lengths in mm");
    }
    units[i] = *unit;
  }
  return units;
}

/// The three axes that lie in space; the others have one layer each. 6: `kinds`; a direction of
/// `none` is one of no space.
std::vector<std::size_t> nrrd_axes(const HeaderFields& fields,
                                   const std::vector<std::int64_t>& sizes,
                                   const std::vector<Vector>& directions) {
  const std::size_t count = sizes.size();
  std::vector<std::string> kinds(count, "???");
  if (fields.has("kinds")) {
    kinds = words_of(fields.text("kinds"));
    if (kinds.size() != count) {
      fields.refuse("kinds", "is not " + std::to_string(count) + " kinds; correct the header");
    }
  }
  std::vector<std::size_t> axes;
  for (std::size_t axis = 0; axis < count; ++axis) {
    const std::string kind = lower(kinds[axis]);
    const bool is_unnamed = kind == "none" || kind == "???" || kind.starts_with("(unknown");
    const bool has_direction = directions.empty() || directions[axis].has_value();
    if ((is_unnamed || kind == "domain" || kind == "space") && has_direction) {
      axes.push_back(axis);
    } else if (sizes[axis] != 1) {
      throw LoadError(fields.path().string() + ": " + std::to_string(sizes[axis]) +
                      " values per voxel along axis " + std::to_string(axis + 1) + " (kind " +
                      one_line(kinds[axis].substr(0, 40)) +
                      (has_direction ? "" : ", no direction") +
                      "); save it as one grey value per voxel");
    }
  }
  for (std::size_t i = axes.size(); i-- > 0 && axes.size() > 3;) {
    if (sizes[axes[i]] == 1) axes.erase(axes.begin() + static_cast<std::ptrdiff_t>(i));
  }
  if (axes.size() == 3) return axes;
  throw LoadError(fields.path().string() + ": " + std::to_string(axes.size()) +
                  " axes; kerf needs a volume of three");
}

/// Spacing and direction of an axis from its vector, in mm and LPS.
void set_axis(const HeaderFields& fields, const Space& space, const std::vector<LengthUnit>& units,
              const std::vector<Written>& vector, const Written* spacing, std::size_t axis,
              UntrustedHeader& claim) {
  double square = 0, rounding = 0;
  for (const Written& number : vector) rounding += number.rounding;
  vec3::Vec direction;
  for (std::size_t i = 0; i < 3; ++i) {
    direction[i] = vector[i].value * space.to_lps[i] * units[i].times / units[i].over;
    square += vector[i].value * vector[i].value;
  }
  const double length = std::sqrt(vec3::dot(direction, direction));
  if (!(length > 0) || (vector.size() == 4 && vector[3].value != 0)) {
    fields.refuse("space directions", "has an axis of no direction in space; correct the header");
  }
  const double written = std::sqrt(square);
  // A root of three squares has four roundings.
  constexpr double kRoundings = 4 * std::numeric_limits<double>::epsilon();
  if (spacing != nullptr && !(std::abs(spacing->value - written) <=
                              spacing->rounding + rounding + kRoundings * written)) {
    fields.refuse("spacings", "contradicts `space directions`, which has " + number_text(written) +
                                  " along axis " + std::to_string(axis + 1) +
                                  "; correct the header");
  }
  claim.spacing_mm[axis] = length;
  for (std::size_t i = 0; i < 3; ++i) claim.axes[axis][i] = direction[i] / length;
  claim.spacing_known |= 1U << axis;
}

/// Without directions: spacings, and `axis mins`, which is the centre of the first voxel or
/// (centers: cell, and by default) its border.
void set_straight(const HeaderFields& fields, const std::vector<std::size_t>& axes,
                  const std::vector<Written>& spacings, const std::vector<LengthUnit>& units,
                  UntrustedHeader& claim) {
  const std::size_t count = spacings.size();
  std::vector<Written> mins(count, {std::numeric_limits<double>::quiet_NaN(), 0});
  if (fields.has("axis mins")) mins = fields.numbers("axis mins", count);
  std::vector<std::string> centers = words_of(fields.text("centers"));
  if (!centers.empty() && centers.size() != count) {
    fields.refuse("centers", "is not one word for each axis; correct the header");
  }
  centers.resize(count);
  for (std::size_t i = 0; i < 3; ++i) {
    const double scale = units[i].times / units[i].over;
    const double spacing = spacings[axes[i]].value, min = mins[axes[i]].value;
    claim.axes[i] = {};
    claim.axes[i][i] = 1;
    if (std::isnan(spacing)) continue;
    claim.spacing_mm[i] = spacing * scale;
    claim.spacing_known |= 1U << i;
    const bool is_node = lower(centers[axes[i]]) == "node";
    if (!std::isnan(min)) claim.origin_mm[i] = (min + (is_node ? 0 : spacing / 2)) * scale;
  }
}

UntrustedHeader nrrd_claim(const HeaderFields& fields, const std::vector<std::int64_t>& sizes) {
  const std::size_t count = sizes.size();
  const Space space = space_of(fields);
  std::vector<Vector> directions;
  for (const char* key : {"space directions", "space origin", "space units"}) {
    if (fields.has(key) && space.dimensions == 0) {
      fields.refuse(key, "without `space` or `space dimension`; correct the header");
    }
  }
  if (fields.has("space directions")) {
    directions = vectors_of(fields, "space directions", count, space.dimensions);
    if (space.dimensions == 4) {  // an axis along time alone
      for (Vector& v : directions) {
        if (v && (*v)[0].value == 0 && (*v)[1].value == 0 && (*v)[2].value == 0) v.reset();
      }
    }
  }
  const std::vector<std::size_t> axes = nrrd_axes(fields, sizes, directions);
  std::vector<Written> spacings(count, {std::numeric_limits<double>::quiet_NaN(), 0});
  if (fields.has("spacings")) spacings = fields.numbers("spacings", count);
  UntrustedHeader claim;
  claim.spacing_known = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    claim.size[i] = sizes[axes[i]];
    if (spacings[axes[i]].value == 0) fields.refuse("spacings", "holds a zero; correct the header");
  }
  const std::vector<LengthUnit> units =
      units_of(fields, "space units", {0, 1, 2}, space.dimensions);
  const vec3::Vec unturned{1, 1, 1};
  if (directions.empty()) {
    if (space.to_lps != unturned) {
      fields.refuse("space",
                    "without `space directions`; add them, such as (0.5,0,0) (0,0.5,0) (0,0,0.5)");
    }
    set_straight(fields, axes, spacings,
                 fields.has("units") ? units_of(fields, "units", axes, count) : units, claim);
    if (space.is_patient) {
      add_note(claim, "no space directions: its axes are taken as those of LPS");
    }
  } else {
    for (const LengthUnit& unit : units_of(fields, "units", axes, count)) {
      if (unit.times == unit.over) continue;
      fields.refuse("units", "does not count with `space directions`; write `space units`");
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const Written& spacing = spacings[axes[i]];
      set_axis(fields, space, units, *directions[axes[i]],
               std::isnan(spacing.value) ? nullptr : &spacing, i, claim);
    }
  }
  if (fields.has("space origin")) {
    const Vector origin = vectors_of(fields, "space origin", 1, space.dimensions)[0];
    for (std::size_t i = 0; origin && i < 3; ++i) {
      claim.origin_mm[i] = (*origin)[i].value * space.to_lps[i] * units[i].times / units[i].over;
    }
  }
  if (fields.has("space") && !space.is_patient) {
    add_note(claim, "space: " + one_line(fields.text("space")) + " is no frame of a patient" +
                        (space.to_lps[2] < 0 ? ", and is mirrored: its third axis is turned" : ""));
  }
  return claim;
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
