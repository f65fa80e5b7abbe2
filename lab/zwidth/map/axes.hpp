// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "lab/zwidth/map/subject.hpp"

namespace kerf::zwidth {

/// What can vary from column to column of a map; the stiffness varies within a column.
enum class AxisId : std::size_t {
  loop,
  device,
  damping,
  rate,
  delay,
  quantum,
  friction,
  viscous,
  mass,
  estimator,
  filter,
  hand,
  mode,
  numeric,
  law,
  stabiliser,
  limits
};
inline constexpr std::size_t kAxisCount = 17;

/// One axis as the command line knows it. A number's `lowest` and `highest` are in its unit.
struct AxisKind {
  const char* name;                ///< its option, without dashes
  const char* unit;                ///< empty: words, or a pure number
  const char* standard;            ///< value where none is given; empty: of the loop or the device
  double lowest = 0, highest = 0;  ///< both 0: words
  const char* words = "";          ///< allowed ones, separated by blanks; empty: checked elsewhere
  const char* meaning = "";
};
[[nodiscard]] const std::array<AxisKind, kAxisCount>& axis_kinds();

/// The values of an axis as texts, in the order of the map. Empty: the axis has its standard value.
using AxisValues = std::vector<std::string>;
using AxisTable = std::array<AxisValues, kAxisCount>;
/// One value for each axis; empty: the standard.
using Assignment = std::array<std::string, kAxisCount>;

/// "0:3:4" (from:to:count, even steps), "0,1,2" or one value, checked against the axis. Throws
/// HilError with one line.
[[nodiscard]] AxisValues axis_values(AxisId axis, const std::string& text);

/// The stiffnesses of "0.05:50:40", even in their ratio, or of a list, which must rise.
[[nodiscard]] std::vector<double> stiffness_values(const std::string& text);

/// All combinations: the last axis turns fastest. Axes without values stay empty.
[[nodiscard]] std::vector<Assignment> combinations(const AxisTable& table);

/// What these values mean, with the standards of their loop and device.
[[nodiscard]] Subject subject_of(const Assignment& values);

/// The value that holds, whether given or standard: as it stands in the files of a map.
[[nodiscard]] std::string value_of(const Assignment& values, AxisId axis);

/// The laws that these values choose, such as "law coupling, estimator foaw, stabiliser none".
[[nodiscard]] std::string laws_of(const Assignment& values);

[[nodiscard]] inline std::size_t index_of(AxisId axis) {
  return static_cast<std::size_t>(axis);
}

/// The axis of that name, `kAxisCount` for "stiffness". Throws HilError that names `option`.
[[nodiscard]] std::size_t axis_named(const char* option, std::string_view name);

}  // namespace kerf::zwidth
