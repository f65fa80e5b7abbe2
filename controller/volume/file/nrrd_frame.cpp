// SPDX-License-Identifier: Apache-2.0
// Where the voxels of a NRRD lie: its spaces, directions, spacings and units, in LPS and mm.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iomanip>
#include <limits>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/header_fields.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "shared/text/text.hpp"

namespace kerf::volume {
namespace {

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

/// Units in quotes, `count` of them; mm for a missing field. Along an axis of the file the unit may
/// be a pixel: NaN, since its spacing is not known then.
std::vector<LengthUnit> units_of(const HeaderFields& fields, const char* key,
                                 const std::vector<std::size_t>& wanted, std::size_t count,
                                 bool allows_pixels = false) {
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
    const std::string& word = words[wanted[i]];
    constexpr std::string_view kPixels = "|px|pixel|pixels|voxel|voxels|";
    const bool is_pixel = kPixels.find("|" + lower(word) + "|") != std::string_view::npos;
    const auto unit = allows_pixels && is_pixel
                          ? LengthUnit{std::numeric_limits<double>::quiet_NaN(), 1}
                          : length_unit(word);
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

/// Whether the border of the volume, or the centre of its first and last voxel (a node), is at
/// `mins` and `maxs`: as the word of `centers` says; without one, as they fit the spacing, by
/// default the border. Refuses a spacing that contradicts them.
bool is_node(const HeaderFields& fields, const std::string& center, std::int64_t size,
             const Written& spacing, const Written& min, const Written& max) {
  const bool says_node = lower(center) == "node", says_cell = lower(center) == "cell";
  const double extent = max.value - min.value;
  const auto fits = [&](std::int64_t steps) {
    const auto count = static_cast<double>(steps);
    // Two products or differences, each of numbers that were rounded as they were read.
    const double rounding = 4 * std::numeric_limits<double>::epsilon() *
                            (std::abs(min.value) + std::abs(max.value) + count * spacing.value);
    return std::abs(count * spacing.value - extent) <=
           count * spacing.rounding + min.rounding + max.rounding + rounding;
  };
  if (std::isnan(extent) || (!says_node && fits(size))) return says_node;
  if (!says_cell && fits(size - 1)) return true;
  fields.refuse("spacings", "contradicts `axis mins` and `axis maxs`, which are " +
                                number_text(extent) + " apart for " + std::to_string(size) +
                                " voxels; correct the header");
}

/// Without directions: spacings, and `axis mins`, which is the centre of the first voxel or
/// (centers: cell, and by default) its border.
void set_straight(const HeaderFields& fields, const std::vector<std::size_t>& axes,
                  const std::vector<Written>& spacings, const std::vector<LengthUnit>& units,
                  UntrustedHeader& claim) {
  const std::size_t count = spacings.size();
  std::vector<Written> mins(count, {std::numeric_limits<double>::quiet_NaN(), 0});
  std::vector<Written> maxs = mins;
  if (fields.has("axis mins")) mins = fields.numbers("axis mins", count);
  if (fields.has("axis maxs")) maxs = fields.numbers("axis maxs", count);
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
    if (std::isnan(spacing * scale)) continue;
    claim.spacing_mm[i] = spacing * scale;
    claim.spacing_known |= 1U << i;
    const bool node = is_node(fields, centers[axes[i]], claim.size[i], spacings[axes[i]],
                              mins[axes[i]], maxs[axes[i]]);
    if (!std::isnan(min)) claim.origin_mm[i] = (min + (node ? 0 : spacing / 2)) * scale;
  }
}

}  // namespace

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
                 fields.has("units") ? units_of(fields, "units", axes, count, true) : units, claim);
    claim.axes_known = 0;
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
  if (space.dimensions > 0 && !space.is_patient) {
    const std::string name =
        fields.has("space") ? one_line(fields.text("space")) : "without a name";
    add_note(claim, "space: " + name + " is no frame of a patient" +
                        (space.to_lps[2] < 0 ? ", and is mirrored: its third axis is turned" : ""));
  }
  return claim;
}

}  // namespace kerf::volume
