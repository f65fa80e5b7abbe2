// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "controller/load/loaded_scene.hpp"

namespace kerf {

// Whether a device can hold the contact of a scene: its stiffness and damping against the exact
// boundary of a sampled wall (docs/theory.md 5.7), at the scene's rate, with the figures of its
// device (device_figures.hpp) and nobody's hand to damp it.
//
// What is checked is a swing that grows. It is soon wider than the 0.1 mm in which the coupling's
// damper comes in, and than the steps of the encoder, so that the damper is whole and the velocity
// window down to one interval: the backward difference of the exact loop. A swing that stays inside
// of both is felt as a hum, and friction takes it. The paper's force has no damper, so only
// friction makes it stable at all: its margin is that with friction, and it is never refused.
//
// A force law has the margin of its worst length (law_slopes.hpp). The low-pass of `difference`
// counts, an estimator of the program's own does as a bare difference, and no stabiliser does.

/// Below, a person is warned: a unit may have half of the damping that its figures say.
inline constexpr double kSafeMargin = 1.5;

struct GainMargin {
  double stiffness_n_per_mm = 0;  ///< at the device
  double damping_ns_per_mm = 0;
  double highest_n_per_mm = 0;                ///< stiffness at the boundary, without friction
  double highest_with_friction_n_per_mm = 0;  ///< the same with it, from a push of 1 N
  bool friction_decides = false;              ///< of the paper's force
  double spring_mm = 0;                       ///< of a force law: where it has these; else 0

  [[nodiscard]] double margin() const noexcept { return highest_n_per_mm / stiffness_n_per_mm; }
  [[nodiscard]] double with_friction() const noexcept {
    return highest_with_friction_n_per_mm / stiffness_n_per_mm;
  }
  /// The one that warns.
  [[nodiscard]] double deciding() const noexcept {
    return friction_decides ? with_friction() : margin();
  }
};

enum class PlayFriction : std::uint8_t { where_it_decides, always };

/// Friction is played, not computed: 20 ms at 1 kHz, eight times as long at 8 kHz. Where it does
/// not decide and nobody asks, its boundary stays 0.
[[nodiscard]] GainMargin gain_margin(const LoadedScene& scene,
                                     PlayFriction friction = PlayFriction::always);

/// What `--check` and `--explain` tell: loop, boundaries and margins, one `name=value` a line, and
/// a note below kSafeMargin.
[[nodiscard]] std::string gain_lines(const LoadedScene& scene, const GainMargin& margin);

/// One line with the highest safe stiffness; empty above kSafeMargin.
[[nodiscard]] std::string gain_warning(const LoadedScene& scene, const GainMargin& margin);

/// Why no device is moved by this scene: unstable without friction, and nobody asked for that
/// (`force.unchecked_gain`). Empty: it may be.
[[nodiscard]] std::string gain_refusal(const LoadedScene& scene, const GainMargin& margin);

/// Why a real device is not given these gains, stable or not: they are above the most that is known
/// of such devices. Empty: it is.
[[nodiscard]] std::string above_device(const LoadedScene& scene);

}  // namespace kerf
