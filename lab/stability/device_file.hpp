// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>

#include "lab/stability/axes.hpp"

namespace kerf::zwidth {

/// A device as `kerf identify` found it (docs/identify.md), from a file `device.toml`: along the
/// axes x, y, z of the device, at its tip.
struct IdentifiedDevice {
  std::array<std::array<double, 3>, 3> mass_kg{};
  std::array<double, 3> viscous_ns_per_mm{};
  std::array<double, 3> coulomb_n{};
  std::array<double, 3> quantum_mm{};
  double delay_s = 0;
};

/// One axis of it, in one direction.
struct DeviceDirection {
  std::array<double, 3> along{};  ///< of length 1
  double mass_kg = 0;             ///< 1 / (n' M^-1 n): a wall acts along n, the tip is free else
  /// n' B n of what is diagonal, and sums of |n| f, |n| q. Exact along an axis.
  double viscous_ns_per_mm = 0, coulomb_n = 0, quantum_mm = 0;
};

/// Throws HilError: file, line, key, value, way out; also for a mass that is not positive definite.
[[nodiscard]] IdentifiedDevice read_device(const std::string& file);

[[nodiscard]] DeviceDirection along(const IdentifiedDevice& device,
                                    std::array<double, 3> direction);

/// "x", "y", "z", "1,0,0", or "worst": of the 13 axes and diagonals of a cube that with the lowest
/// exact linear boundary at this damping and rate. Throws HilError for another text.
[[nodiscard]] DeviceDirection direction_of(const IdentifiedDevice& device, const std::string& text,
                                           double damping_ns_per_mm, double rate_hz);

/// Gives a map those axes of the device in this direction that `texts` leaves empty: mass, viscous,
/// friction, quantum, delay. `texts` has one value of each axis that the delay in periods needs,
/// the rate, or none. Throws HilError.
[[nodiscard]] DeviceDirection take_device(const std::string& file, const std::string& direction,
                                          std::array<std::string, kAxisCount>& texts);

}  // namespace kerf::zwidth
