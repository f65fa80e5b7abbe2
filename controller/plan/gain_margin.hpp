// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "controller/load/loaded_scene.hpp"

// Whether a device can hold the contact of a scene: its stiffness and damping against the exact
// boundary of a sampled wall (docs/forces.md 5.7), at the scene's rate, with the figures of its
// device (controller/stability), or those of `device.identified` across its worst direction, and
// without a hand that damps it.
//
// The criterion is an oscillation that grows. It soon exceeds the 0.1 mm over which the coupling's
// damper sets in, and the steps of the encoder. Then the damper acts fully, and the velocity window
// has one interval: the backward difference of the exact loop. A smaller oscillation is a hum that
// friction stops. The paper's force has no damper, so only friction makes it stable at all: its
// margin is that with friction, and it is never refused.
//
// A force law has the margin of its worst length. The low-pass of `difference` is included, any
// other estimator is treated as a plain difference, and a stabiliser is ignored.

namespace kerf {

/// Below this margin the user is warned: a device may have half of the damping of its figures.
inline constexpr double kSafeMargin = 1.5;

struct GainMargin {
  double stiffness_n_per_mm = 0;  ///< at the device
  double damping_ns_per_mm = 0;
  double highest_n_per_mm = 0;                ///< stiffness at the boundary, without friction
  double highest_with_friction_n_per_mm = 0;  ///< with it, at the worst push
  bool friction_decides = false;              ///< of the paper's force
  double spring_mm = 0;  ///< of a force law: the length of these values; else 0

  [[nodiscard]] double margin() const noexcept { return highest_n_per_mm / stiffness_n_per_mm; }
  [[nodiscard]] double with_friction() const noexcept {
    return highest_with_friction_n_per_mm / stiffness_n_per_mm;
  }
  /// The margin for the warning.
  [[nodiscard]] double deciding() const noexcept {
    return friction_decides ? with_friction() : margin();
  }
};

enum class PlayFriction : std::uint8_t { where_it_decides, always };

/// Friction is simulated, not computed, which takes some 10 ms, up to 0.4 s at 8 kHz. If friction
/// does not decide and the caller does not request it, its boundary is 0.
[[nodiscard]] GainMargin gain_margin(const LoadedScene& scene,
                                     PlayFriction friction = PlayFriction::always);

/// Lines of `--check` and `--explain`: loop, boundaries and margins, one `name=value` a line, and a
/// note below kSafeMargin.
[[nodiscard]] std::string gain_lines(const LoadedScene& scene, const GainMargin& margin);

/// One line with the highest safe stiffness; empty above kSafeMargin.
[[nodiscard]] std::string gain_warning(const LoadedScene& scene, const GainMargin& margin);

/// Why the scene must not drive a device: it is unstable without friction, and
/// `force.unchecked_gain` is not set. Empty if it may.
[[nodiscard]] std::string gain_error(const LoadedScene& scene, const GainMargin& margin);

/// Why a real device must not get these gains, even if they are stable: they are above the largest
/// known safe values for it. Empty if it may.
[[nodiscard]] std::string device_limit_error(const LoadedScene& scene);

}  // namespace kerf
