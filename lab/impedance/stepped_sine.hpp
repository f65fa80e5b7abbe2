// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <cstdint>
#include <numbers>
#include <optional>

#include "lab/stability/axes.hpp"

/// What a hand feels over frequency (docs/forces.md 5.8): by theory, and from motion.
namespace kerf::impedance {

/// Force over velocity, N s/mm.
using Impedance = std::complex<double>;

inline constexpr double kTurn = 2 * std::numbers::pi;  ///< rad

/// The stiffness that a hand feels, N/mm.
[[nodiscard]] double felt_stiffness(Impedance z, double hz);

/// A sine of whole periods in whole ticks, so that no other frequency leaks into its fundamental.
/// Both have no common divisor: so each tick has a phase that no other has, and encoder steps are
/// met evenly.
struct SteppedSine {
  double hz;
  std::int64_t periods, ticks;
};

/// A sine within 0.5 % of `hz`, of at least so many periods and ticks.
[[nodiscard]] SteppedSine sine_near(double hz, double rate_hz, std::int64_t least_periods = 8,
                                    std::int64_t least_ticks = 4096);

/// Where the tip moves to and fro in the wall: x = -middle + amplitude cos wt.
struct Stroke {
  double amplitude_mm = 0, middle_mm = 0;
};

/// The largest stroke up to `most_mm` at which the law stays linear: the contact is never left, the
/// damper of the coupling is in full, and peak and slew are kept by a tenth if the subject has
/// limits (but for the jumps of encoder steps). Empty if the limits leave none of `kLeastMm`.
[[nodiscard]] std::optional<Stroke> stroke_at(const zwidth::LoopCase& subject,
                                              double stiffness_n_per_mm, double hz, double most_mm);
inline constexpr double kLeastMm = 0.001;  ///< 65 steps of a fixed-point position

/// One frequency, measured.
struct SineResult {
  double hz = 0;
  double amplitude_mm = 0;
  std::optional<Impedance> wall;  ///< empty: the limits of the force leave no such motion
  std::optional<Impedance> port;  ///< of the whole arm alone, by the force of its hand
};

/// The wall of the servo on one axis, in the subject's numbers, by a tip that moves as this sine:
/// the fundamental of the force that is held from the delay after each reading on. Throws HilError
/// if the law fails.
[[nodiscard]] SineResult measure_one_axis(const zwidth::LoopCase& subject,
                                          double stiffness_n_per_mm, const SteppedSine& sine,
                                          double most_mm);

}  // namespace kerf::impedance
