// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shared/text/json.hpp"

/// What the rows of `kerf-lab reproduce` measure and no other command gives: single runs, by their
/// figures as JSON. Each throws HilError with one line for a figure that is unknown, no number or
/// out of its range; the same figures give the same bits.
namespace kerf::reproduce {

/// A mass that meets a spring wall at y = 0 by the servo's own ledger, limits off, in double:
///
///     mass_kg viscous_ns_per_mm friction_n quantum_mm                      of the device
///     rate_hz delay_periods                                                of the loop
///     stiffness_n_per_mm passivity (0 or 1: observer and controller)       of the wall
///     push_n speed_mm_per_s start_mm seconds                               of the hand,
///     hand_kg hand_ns_per_mm hand_n_per_mm    whose spring is slack at the wall's face
///
/// Returns {s, tip_mm, port_mj, observed_mj} as lists of at most 2,000 points each, and
/// {lowest_port_mj, lowest_observed_mj, last_port_mj, swing_mm, peak_n, last_depth_mm,
/// ended_early}: the energy that the port has taken, by the true motion and by the encoder's; peak
/// to peak in the last third; a tip that is farther off than a metre ends the run.
[[nodiscard]] Json contact_energy(const Json& figures);

/// A ball bur that a hand presses into a flat solid with a constant force, by the whole servo step
/// and the default law of removal:
///
///     press_n radius_mm seconds                                            of the hand and its
///     tool settings                                        a list of KEY=VALUE, as --set of a
///     controller
///
/// Returns {rate_mm3_per_s, first_mm3_per_s, last_mm3_per_s, press_n, spindle_ratio}: means over
/// the run, its first and its last quarter. Throws LoadError, too.
[[nodiscard]] Json cut_rate(const Json& figures);

/// The devices of kerf's table, by their words: {mass_kg, viscous_ns_per_mm, friction_n,
/// quantum_mm, delay_s, stiffness_n_per_mm, damping_ns_per_mm, peak_n, continuous_n}; and `scene`,
/// the limits of one that sets none, with the Omni's links.
[[nodiscard]] Json device_table();

}  // namespace kerf::reproduce
