// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/volume_frame.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "controller/input/load_error.hpp"
#include "shared/numeric/elementary.hpp"
#include "shared/text/text.hpp"

namespace kerf {

using volume::UntrustedHeader;

namespace {

void add_sentence(std::string& note, const std::string& sentence) {
  note += (note.empty() ? "" : "; ") + sentence;
}

constexpr std::string_view kAxisLetters = "xyz";
constexpr const char* kOverride =
    "`override_spacing_mm = [..]` in the scene or `--override-spacing`";

/// Shortest text of a length that reads back as the same float: headers have no more digits, and
/// what is computed from theirs, such as 0.7000000000000001, has noise beyond them.
std::string mm_text(double mm) {
  std::array<char, 512> text{};
  const auto end =
      std::to_chars(text.begin(), text.end(), static_cast<float>(mm), std::chars_format::fixed);
  return {text.data(), end.ptr};
}

/// How far a value may be from the one that was rounded to it, mm: half a unit of the last digit of
/// its text. 0 for less than three digits: 0.5 and 1 are rather values of their own.
double rounding_mm(double value) {
  const std::string text = mm_text(value);
  const std::size_t point = text.find('.');
  const std::size_t decimals = point == text.npos ? 0 : text.size() - point - 1;
  const double unit = power_of_tenth(static_cast<int>(decimals));
  return value < 100 * unit ? 0 : unit / 2;
}

/// Whether two distances are one but for the rounding of floats: of a length from three of them,
/// the root of a sum of squares, at most two units of each.
bool is_same(double file_mm, double given_mm) {
  constexpr double kNoise = 4 * std::numeric_limits<float>::epsilon();
  return std::abs(file_mm - given_mm) <= kNoise * file_mm;
}

/// Whether two distances along an axis of `count` voxels are one, rounded: to the digits of the
/// coarser one, and no voxel moves by more than half a voxel.
bool is_rounded(double file_mm, double given_mm, std::int32_t count) {
  const double apart_mm = std::abs(file_mm - given_mm);
  return apart_mm <= std::max(rounding_mm(file_mm), rounding_mm(given_mm)) &&
         2 * apart_mm * (count - 1) <= file_mm;
}

/// The spacing along each axis, a letter for one that is not known.
std::string spacing_text(const std::array<double, 3>& mm, std::uint32_t known,
                         const char* between) {
  std::string text;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    text += axis == 0 ? "" : between;
    text += (known >> axis & 1) != 0 ? mm_text(mm[axis]) : std::string(1, kAxisLetters[axis]);
  }
  return text;
}

[[noreturn]] void refuse_unspaced(const std::string& location, const std::array<double, 3>& mm,
                                  std::uint32_t known, const std::string& bad) {
  std::string axes;
  for (std::size_t axis = 0; known != 0 && axis < 3; ++axis) {
    if ((known >> axis & 1) != 0) continue;
    axes += (axes.empty() ? " along " : ", ") + std::string(1, kAxisLetters[axis]);
  }
  throw LoadError(location + ": spacing" + axes +
                  (bad.empty() ? " is not in the file" : " cannot be read from " + bad) +
                  "; add `spacing_mm = [" + spacing_text(mm, known, ", ") +
                  "]` to the scene or `--spacing " + spacing_text(mm, known, ",") + "` (mm)");
}

}  // namespace

void take_spacing(const std::string& location, const ReadOptions& options,
                  const UntrustedHeader& claim, SourceVolume& volume) {
  const std::uint32_t in_file = claim.spacing_known & kAllAxes;
  std::array<double, 3> mm{1, 1, 1};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if ((in_file >> axis & 1) != 0) mm[axis] = claim.spacing_mm[axis];
  }
  volume.spacing_known = in_file;
  if (options.override_spacing_mm) {
    volume.spacing_known = kAllAxes;
    volume.spacing_mm = *options.override_spacing_mm;
    check_spacing(location, volume.spacing_mm, kOverride);
    add_sentence(volume.note,
                 "OVERRIDDEN: spacing " + spacing_text(volume.spacing_mm, kAllAxes, " x ") +
                     " mm in place of the file's " +
                     (in_file == 0 ? "none" : spacing_text(mm, in_file, " x ") + " mm"));
    return;
  }
  check_spacing(location, mm, kOverride);
  if (options.spacing_mm) {
    const std::array<double, 3>& given = *options.spacing_mm;
    check_spacing(location, given);
    const std::array<std::int32_t, 3> count{volume.grid.nx, volume.grid.ny, volume.grid.nz};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if ((in_file >> axis & 1) == 0) {
        mm[axis] = given[axis];
      } else if (!is_same(mm[axis], given[axis])) {
        const std::string both = mm_text(given[axis]) + " mm along " + kAxisLetters[axis];
        if (!is_rounded(mm[axis], given[axis], count[axis])) {
          throw LoadError(location + ": spacing " + both + " is given, and the file has " +
                          mm_text(mm[axis]) + "; leave it out, or replace the file's with " +
                          kOverride);
        }
        add_sentence(volume.note, "spacing " + both + " is given, rounded; the file's " +
                                      mm_text(mm[axis]) + " is used");
      }
    }
    volume.spacing_known = kAllAxes;
  } else if (in_file != kAllAxes && !options.allow_missing_spacing) {
    const std::string bad(claim.bad_spacing.begin(), std::ranges::find(claim.bad_spacing, '\0'));
    refuse_unspaced(location, mm, in_file, escaped(bad));
  }
  volume.spacing_mm = mm;
}

namespace {

constexpr std::string_view kToward = "LPSRAI";  // +x, +y, +z of LPS, then -x, -y, -z
constexpr std::array<const char*, 6> kWhere{"left", "back", "top", "right", "front", "bottom"};

/// Index in kToward of the direction next to `axis`.
std::size_t nearest(const vec3::Vec& axis) {
  const auto* const most = std::ranges::max_element(axis, {}, [](double x) { return std::abs(x); });
  const auto at = static_cast<std::size_t>(most - axis.begin());
  return *most < 0 ? at + 3 : at;
}

/// Directions in LPS from three letters, one of each pair: L or R (left, right of the body), P or A
/// (back, front), S or I (top, bottom). An axis leads toward its letter, as in NRRD and nibabel; in
/// any case. Throws LoadError, which begins with `location`.
std::array<vec3::Vec, 3> axes_from(const std::string& location, const std::string& letters) {
  std::array<vec3::Vec, 3> axes{};
  std::array<bool, 3> taken{};
  for (std::size_t axis = 0; axis < letters.size() && letters.size() == 3; ++axis) {
    const char letter =
        letters[axis] >= 'a' ? static_cast<char>(letters[axis] - 'a' + 'A') : letters[axis];
    const std::size_t at = kToward.find(letter);
    if (at == kToward.npos || taken[at % 3]) break;
    taken[at % 3] = true;
    axes[axis][at % 3] = at < 3 ? 1 : -1;
  }
  if (std::ranges::all_of(taken, [](bool is) { return is; })) return axes;
  throw LoadError(location + ": " + one_line(letters) +
                  " is not three letters, one of L R, one of P A and one of S I; give where "
                  "columns, rows and slices lead in the body, such as LPS");
}

}  // namespace

std::string take_axes(const std::string& location, const std::string& letters,
                      volume::UntrustedHeader& claim) {
  if (!letters.empty()) {
    const auto given = axes_from("--axes", letters);
    if (claim.axes_known != 0) {
      throw LoadError("--axes: " + location + " has axes; leave it out");
    }
    claim.axes = given;
    return {};
  }
  if (claim.axes_known != 0) return {};
  std::string word, words;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    constexpr std::array<const char*, 3> kAxes{"columns to the ", ", rows to the ",
                                               ", slices to the "};
    const std::size_t at = nearest(claim.axes[axis]);
    word += kToward[at];
    words += std::string(kAxes[axis]) + kWhere[at];
  }
  return word + " (" + words +
         " of a body), which the file does not say: if not so, it is turned or mirrored";
}

}  // namespace kerf
