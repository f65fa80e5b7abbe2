// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "controller/law/law.hpp"

namespace kerf {

/// A law by its name, and those of its settings that differ from their defaults, in any order.
struct LawChoice {
  LawKind kind = LawKind::force;
  std::string name;  ///< empty: the default of its kind
  std::vector<std::pair<std::string, double>> settings;

  friend bool operator==(const LawChoice&, const LawChoice&) = default;
};

/// A choice that cannot be made: one line ` problem; remedy`, to be put after its location.
struct LawError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// `force law`, `velocity estimator`, `stabiliser`.
[[nodiscard]] std::string_view kind_name(LawKind kind) noexcept;

/// All laws of a kind that a scene can name, by name: ours, and those of its own files. Throws
/// std::runtime_error, a whole line, if two have the same name.
[[nodiscard]] std::vector<const LawRow*> known_laws(LawKind kind);

/// The law of a choice without a name: of a force law the virtual coupling, else null. A scene sets
/// its numbers by the keys force.stiffness_n_per_mm and force.damping_ns_per_mm.
[[nodiscard]] const LawRow* default_law(LawKind kind) noexcept;

/// Throws LawError with the known names for one that is unknown.
[[nodiscard]] const LawRow& find_law(LawKind kind, std::string_view name);

/// The law that a scene chooses by one word: null for the word that stands for the default of the
/// kind. Throws LawError with the known names and that word.
[[nodiscard]] const LawRow* law_by_word(LawKind kind, std::string_view word);

/// The problem with a value of a setting, as text after `setting = value`; empty if there is none.
[[nodiscard]] std::string setting_problem(const LawRow& row, std::string_view setting,
                                          double value);

/// One value for each setting of the row, in its order; throws LawError for a setting that the law
/// does not have and for a value out of its range.
[[nodiscard]] std::vector<double> law_values(const LawRow& row, const LawChoice& choice);

/// The constants of the loop that a law will run in.
struct LawLoop {
  double rate_hz = 1000;
  double tip_noise_mm = 0;  ///< no encoder reading is farther from the true tip, at the device port
};

/// The plan of a choice, in the numbers of `N`; empty if it has no name and its kind no default.
/// Throws LawError.
template <template <class> class In, class N>
[[nodiscard]] LawPlan<In<N>> plan_law(const LawChoice& choice, const LawLoop& loop) {
  const LawRow* row =
      choice.name.empty() ? default_law(choice.kind) : &find_law(choice.kind, choice.name);
  if (row == nullptr) return {};
  const auto& known = static_cast<const LawRowOf<In>&>(*row);
  const std::vector<double> values = law_values(*row, choice);
  const LawSetup setup(loop.rate_hz, loop.tip_noise_mm, row->settings, values);
  const auto make = [&] {
    if constexpr (std::is_same_v<N, FixedNumbers>)
      return known.fixed;
    else
      return known.float64;
  }();
  const auto plan = make(setup);
  if (!setup.unknown().empty()) {
    throw LawError(" reads a setting " + std::string(setup.unknown()) +
                   " that its kSettings do not list; add it there");
  }
  return plan;
}

}  // namespace kerf
