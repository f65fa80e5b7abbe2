// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/scene/scene.hpp"
#include "controller/stability/sampled_loop.hpp"
#include "shared/wire/personality.hpp"

namespace kerf::zwidth {

/// How the wall reads the hand's speed.
enum class Estimator : std::uint8_t {
  foaw,       ///< the servo's own window (docs/theory.md 5.2)
  difference  ///< of two readings, through the loop's low-pass
};

/// The force of a wall that is pressed in by delta at speed v outwards.
enum class Law : std::uint8_t {
  coupling,  ///< the servo's own (docs/theory.md 5.1): its damper grows with the spring
  linear,    ///< max(0, K delta - B v)
  two_sided  ///< -K x - B v on both sides of the face: what the exact boundary is about
};

/// One cell of a map but for its stiffness: what is pressed against the wall, and what the wall is.
struct Subject {
  SampledLoop loop;
  double damping_ns_per_mm = 0;
  double push_n = 0.5;  ///< of the hand, above Coulomb friction
  Estimator estimator = Estimator::foaw;
  Law law = Law::coupling;
  NumericKind numeric = NumericKind::fixed;
  bool limits = true;  ///< peak, thermal budget and slew of a scene that sets none
  // Of the whole arm alone:
  Personality device = Personality::omni;
  double mode_hz = 0;  ///< structural mode; 0: rigid
};

}  // namespace kerf::zwidth
