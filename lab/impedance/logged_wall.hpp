// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "lab/impedance/stepped_sine.hpp"

namespace kerf::impedance {

/// A recorded run (docs/log.md) as far as its wall counts: the longest stretch of ticks in contact,
/// without a lost report, a limit that acted or a fault, along the mean of its force.
struct LoggedWall {
  double rate_hz = 0;
  double stiffness_n_per_mm = 0, damping_ns_per_mm = 0;  ///< of its scene
  std::string estimator, law, stabiliser;                ///< of its scene, as values of the axes
  std::vector<double> tip_mm, force_n;                   ///< of each tick, at the device
};

/// Reads the first arm's log. Throws HilError for a folder that is no sound recording, a scene
/// without a stiffness, and less than a second of such contact.
[[nodiscard]] LoggedWall read_logged_wall(const std::filesystem::path& folder);

/// The wall at this frequency, from the motion that the log happens to have there: the cross
/// spectrum of force and position over that of the position, means of overlapping segments (Welch),
/// with hold and delay of `loop`. The position is what the law was given, so its encoder steps are
/// no noise. Without a wall if the motion there explains the force so little that the ratio has a
/// standard error above 2 % (Bendat and Piersol), or if the stretch has less than two segments.
[[nodiscard]] SineResult logged_at(const LoggedWall& wall, const SampledLoop& loop, double hz);

}  // namespace kerf::impedance
