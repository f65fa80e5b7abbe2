// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace kerf {

/// Where the work at the device port goes to or comes from (docs/forces.md 5.5): the columns of the
/// tick record, in its order. Their sum is the work that the loop took from the hand.
enum class EnergySource : std::uint8_t {
  spring,  ///< the virtual coupling, or the contact force of another law, computed without sampling
  damping,    ///< injected with the spring
  friction,   ///< of the tool on the solid: the part of the spring along the faces
  cutting,    ///< reaction of the removal, friction of the cutter
  limits,     ///< changes by peak, thermal, slew and motor limits
  hold,       ///< fading in; force kept or faded while reports are missing
  leak,       ///< sample and hold of spring and friction: acts like a damping of -K T/2
  stabiliser  ///< the work that the stabiliser of the scene added
};
inline constexpr std::size_t kEnergySources = 8;

inline constexpr std::array<std::string_view, kEnergySources> kEnergySourceNames = {
    "spring", "damping", "friction", "cutting", "limits", "hold", "leak", "stabiliser"};

/// Energies in the record and the output: mJ with 32 fraction bits.
inline constexpr double kEnergyStepsPerMj = 4294967296.0;
[[nodiscard]] constexpr double energy_mj_of_steps(std::int64_t steps) noexcept {
  return static_cast<double>(steps) / kEnergyStepsPerMj;
}

}  // namespace kerf
