// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace kerf {

/// Devices of one scene, each an arm with a tool of its own.
inline constexpr std::size_t kMaxArms = 2;

/// Which device is held. The first three are joint-count devices: kerf reads their encoders and
/// drives their motors. The others are Cartesian: a service or a library of the vendor stands
/// between, which reports a pose and takes a force (shared/wire/cartesian.hpp).
enum class Personality : std::uint8_t { omni, falcon, woodenhaptics, inverse3, touch, omega };

inline constexpr std::array<std::string_view, 6> kPersonalityWords{
    "omni", "falcon", "woodenhaptics", "inverse3", "touch", "omega"};

[[nodiscard]] constexpr std::string_view word_of(Personality personality) noexcept {
  return kPersonalityWords[static_cast<std::size_t>(personality)];
}

[[nodiscard]] constexpr bool is_cartesian(Personality personality) noexcept {
  return personality >= Personality::inverse3;
}

/// What a device may give at most, and what a scene that says nothing takes: N, N (RMS over time)
/// and N/ms. `peak_n` is also the highest value that a scene may set.
///
/// The Omni's: data sheet. Falcon and WoodenHaptics can give more (8.9 N and 5 N by their makers),
/// but kerf has only been tested with the Omni's on them. Inverse3: product page. Touch: the
/// vendor's configuration file. omega.3: product page, continuous. The slew rises with the peak:
/// from no force to the peak in 6.6 ms, as the Omni's.
struct ForceFigures {
  double peak_n = 3.3;
  double continuous_n = 0.88;
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
