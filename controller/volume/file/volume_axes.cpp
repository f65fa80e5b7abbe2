// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/volume_axes.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string_view>

#include "controller/input/load_error.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

constexpr std::string_view kToward = "LPSRAI";  // +x, +y, +z of LPS, then -x, -y, -z
constexpr std::array<const char*, 6> kWhere{"left", "back", "top", "right", "front", "bottom"};

/// Index in kToward of the direction next to `axis`.
std::size_t nearest(const vec3::Vec& axis) {
  const auto* const most = std::ranges::max_element(axis, {}, [](double x) { return std::abs(x); });
  const auto at = static_cast<std::size_t>(most - axis.begin());
  return *most < 0 ? at + 3 : at;
}

}  // namespace

std::array<vec3::Vec, 3> axes_from(const std::string& place, const std::string& letters) {
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
  throw LoadError(place + ": " + one_line(letters) +
                  " is not three letters, one of L R, one of P A and one of S I; give where "
                  "columns, rows and slices lead in the body, such as LPS");
}

std::string take_axes(const std::string& place, const std::string& letters,
                      volume::UntrustedHeader& claim) {
  if (!letters.empty()) {
    const auto given = axes_from("--axes", letters);
    if (claim.axes_known != 0) {
      throw LoadError("--axes: " + place + " has axes of its own; leave it out");
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
