// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "controller/law/registry/law_registry.hpp"
#include "controller/scene/scene.hpp"
#include "controller/stability/sampled_loop.hpp"
#include "lab/stability/press.hpp"
#include "shared/wire/personality.hpp"

/// The axes of a map, their values, and the loop at a wall that one value of each describes.
namespace kerf::zwidth {

/// The force of a wall that is pressed in by delta at speed v outwards.
enum class Law : std::uint8_t {
  coupling,   ///< the servo's own (docs/forces.md 5.1): its damper grows with the spring
  linear,     ///< max(0, K delta - B v)
  two_sided,  ///< -K x - B v on both sides of the face: the loop of the exact boundary
  paper,      ///< the paper's pressure on the covered voxels, of the whole arm alone
  own         ///< `LoopCase::force_law`
};

/// One cell of a map without its stiffness: the loop that is pressed against the wall, and the
/// wall.
struct LoopCase {
  SampledLoop loop;
  double damping_ns_per_mm = 0;
  PressChoice press;
  LawChoice estimator{LawKind::velocity, "foaw", {}};
  Law law = Law::coupling;
  LawChoice force_law{LawKind::force, "", {}};  ///< K and B are settings of it
  LawChoice stabiliser{LawKind::stabiliser, "", {}};
  NumericKind numeric = NumericKind::fixed;
  /// Peak and slew of a scene that sets none. The thermal budget is never used up: motors that get
  /// weaker make a swing die out that a cool device goes on with.
  bool limits = true;
  // Of the whole arm alone:
  Personality device{};
  double mode_hz = 0;  ///< structural mode; 0: rigid
};

/// The subject's own force law at this stiffness: `stiffness_n_per_mm` and, if it has it,
/// `damping_ns_per_mm` are its settings.
[[nodiscard]] inline LawChoice force_law_at(const LoopCase& subject, double stiffness_n_per_mm) {
  LawChoice choice = subject.force_law;
  if (choice.name.empty()) return choice;
  choice.settings.emplace_back("stiffness_n_per_mm", stiffness_n_per_mm);
  for (const LawSetting& setting : find_law(LawKind::force, choice.name).settings) {
    if (setting.name == "damping_ns_per_mm") {
      choice.settings.emplace_back(setting.name, subject.damping_ns_per_mm);
    }
  }
  return choice;
}

/// The axes that can vary from column to column of a map; the stiffness varies within a column.
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
  limits,
  push,
  hit,
  start
};
inline constexpr std::size_t kAxisCount = 20;

/// One axis as the command line knows it. A number's `lowest` and `highest` are in its unit.
struct AxisKind {
  const char* name;                ///< its option, without dashes
  const char* unit;                ///< empty: words, or a pure number
  const char* standard;            ///< value if none is given; empty: of the loop or the device
  double lowest = 0, highest = 0;  ///< both 0: words
  /// Allowed ones, separated by blanks, of a number beside its range; empty: checked elsewhere.
  const char* words = "";
  const char* meaning = "";
};
[[nodiscard]] const std::array<AxisKind, kAxisCount>& axis_kinds();

/// The values of an axis as texts, in the order of the map. Empty: the axis has its standard value.
using AxisValues = std::vector<std::string>;
using AxisTable = std::array<AxisValues, kAxisCount>;
/// One value for each axis; empty: the standard.
using Assignment = std::array<std::string, kAxisCount>;

/// "0:3:4" (from:to:count, even steps), "0,1,2" or one value, checked against the axis; numbers in
/// rising order, whatever that of the text. Throws HilError with one line, also for a value twice.
[[nodiscard]] AxisValues axis_values(AxisId axis, const std::string& text);

/// The stiffnesses of "0.05:50:40", even in their ratio, or of a list, in rising order. Throws
/// HilError with one line, also for a value twice.
[[nodiscard]] std::vector<double> stiffness_values(const std::string& text);

/// Such a text of another option, whose values have other limits.
struct RatioOption {
  const char* name;     ///< without dashes
  const char* example;  ///< of a range and of a list, with what they mean
  const char* unit;
  double lowest, highest;
};
[[nodiscard]] std::vector<double> ratio_values(const RatioOption& option, const std::string& text);

/// To seven digits: the same text, and so the same number, with every libm.
[[nodiscard]] double seven_digits(double value);

/// All combinations: the last axis turns fastest. Axes without values stay empty.
[[nodiscard]] std::vector<Assignment> combinations(const AxisTable& table);

/// The subject of these values, with the standards of their loop and device.
[[nodiscard]] LoopCase subject_of(const Assignment& values);

/// Throws HilError for a low-pass with an estimator that has none behind it.
void check_filter(const Assignment& values);

/// The value in force, given or standard, as in the files of a map.
[[nodiscard]] std::string value_of(const Assignment& values, AxisId axis);

/// The laws that these values choose, such as "law coupling, estimator foaw, stabiliser none".
[[nodiscard]] std::string laws_of(const Assignment& values);

[[nodiscard]] inline std::size_t index_of(AxisId axis) {
  return static_cast<std::size_t>(axis);
}

/// The axis of that name, `kAxisCount` for "stiffness". Throws HilError that names `option`.
[[nodiscard]] std::size_t axis_named(const char* option, std::string_view name);

}  // namespace kerf::zwidth
