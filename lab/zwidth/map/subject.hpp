// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/law/registry/law_registry.hpp"
#include "controller/scene/scene.hpp"
#include "controller/stability/sampled_loop.hpp"
#include "shared/wire/personality.hpp"

namespace kerf::zwidth {

/// The force of a wall that is pressed in by delta at speed v outwards.
enum class Law : std::uint8_t {
  coupling,   ///< the servo's own (docs/theory.md 5.1): its damper grows with the spring
  linear,     ///< max(0, K delta - B v)
  two_sided,  ///< -K x - B v on both sides of the face: what the exact boundary is about
  paper,      ///< the paper's pressure on the covered voxels, of the whole arm alone
  own         ///< `Subject::force_law`
};

/// One cell of a map but for its stiffness: what is pressed against the wall, and what the wall is.
struct Subject {
  SampledLoop loop;
  double damping_ns_per_mm = 0;
  double push_n = 0.5;  ///< of the hand, above Coulomb friction
  LawChoice estimator{LawKind::velocity, "foaw", {}};
  Law law = Law::coupling;
  LawChoice force_law{LawKind::force, "", {}};  ///< K and B are settings of it
  LawChoice stabiliser{LawKind::stabiliser, "", {}};
  NumericKind numeric = NumericKind::fixed;
  /// Peak and slew of a scene that sets none. The thermal budget is never used up: motors that get
  /// weaker make a swing die out that a cool device goes on with.
  bool limits = true;
  // Of the whole arm alone:
  Personality device = Personality::omni;
  double mode_hz = 0;  ///< structural mode; 0: rigid
};

/// The subject's own force law at this stiffness: `stiffness_n_per_mm` and, where it has it,
/// `damping_ns_per_mm` are its settings.
[[nodiscard]] inline LawChoice force_law_at(const Subject& subject, double stiffness_n_per_mm) {
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

}  // namespace kerf::zwidth
