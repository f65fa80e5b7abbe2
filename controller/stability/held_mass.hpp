// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "controller/stability/sampled_loop.hpp"

namespace kerf {

/// The device and the hand of a loop (mass, viscous friction, hand; no Coulomb friction) while a
/// force is held: how place (mm) and speed (mm per period) after a while follow from those before,
/// `free`, and from 1 N, `driven`. Exact to the last digits: by the matrix exponential, without
/// libm's.
struct HeldMass {
  std::array<std::array<double, 2>, 2> free{};
  std::array<double, 2> driven{};
};

/// After `periods` >= 0 of the loop.
[[nodiscard]] HeldMass held_mass(const SampledLoop& loop, double periods);

}  // namespace kerf
