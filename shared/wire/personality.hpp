// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace kerf {

/// Most devices of one scene; each is an arm with a tool of its own.
inline constexpr std::size_t kMaxArms = 2;

/// Kind of device. The first three are joint-count devices: kerf reads their encoders and drives
/// their motors. The others are Cartesian: the vendor's service or library reports a pose and takes
/// a force (shared/wire/cartesian.hpp).
enum class Personality : std::uint8_t { omni, falcon, woodenhaptics, inverse3, touch, omega };

inline constexpr std::array<std::string_view, 6> kPersonalityWords{
    "omni", "falcon", "woodenhaptics", "inverse3", "touch", "omega"};

[[nodiscard]] constexpr std::string_view word_of(Personality personality) noexcept {
  return kPersonalityWords[static_cast<std::size_t>(personality)];
}

[[nodiscard]] constexpr bool is_cartesian(Personality personality) noexcept {
  return personality >= Personality::inverse3;
}

/// Force limits of a device, the defaults of a scene. No scene may set a force above `peak_n`.
///
/// Sources: Omni, data sheet; Inverse3, product page; Touch, the vendor's configuration file;
/// omega.3, the continuous force of the product page. Falcon and WoodenHaptics can exert more (8.9
/// N and 5 N by their makers), but kerf has only been tested with the Omni's limits on them. The
/// slew rate is in proportion to the peak: 6.6 ms from zero to the peak.
struct ForceFigures {
  double peak_n = 3.3;
  double continuous_n = 0.88;  ///< RMS over time
  double slew_n_per_ms = 0.5;
};

[[nodiscard]] constexpr ForceFigures force_figures(Personality personality) noexcept {
  switch (personality) {
    case Personality::inverse3:
      return {10, 4, 1.5};
    case Personality::omega:
      return {12, 12, 1.8};
    case Personality::omni:
    case Personality::falcon:
    case Personality::woodenhaptics:
    case Personality::touch:
      break;
  }
  return {};
}

}  // namespace kerf
