// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

// A device as `kerf identify` found it (docs/gains.md): what a file device.toml has, for maps,
// scenes and the emulator.

namespace kerf {

/// A file that is no such device, as one line: file, line, key, value, way out.
struct DeviceFileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A delay is shorter than so many periods of the rate at which it was found: the model of a
/// sampled loop ends there (kMaxDelayPeriods).
inline constexpr double kMostIdentifiedPeriods = 64;

/// Along the axes x, y, z of the device, at its tip.
struct IdentifiedDevice {
  using Axes = std::array<double, 3>;

  std::array<Axes, 3> mass_kg{};  ///< symmetric, positive definite
  Axes viscous_ns_per_mm{};
  Axes coulomb_n{};
  Axes quantum_mm{};
  double delay_s = 0;     ///< from the reading of the encoders to the force
  double rate_hz = 1000;  ///< of the servo in the recording
  /// The unfavourable ends of the 95 % intervals; of a file without them, the values.
  Axes least_viscous_ns_per_mm{}, least_coulomb_n{};
  double most_delay_s = 0;
};

/// One axis of it, in one direction.
struct DeviceDirection {
  IdentifiedDevice::Axes along{};  ///< of length 1
  double mass_kg = 0;              ///< 1 / (n' M^-1 n): a wall acts along n, the tip is free else
  /// n' B n of what is diagonal, and sums of |n| f, |n| q. Exact along an axis.
  double viscous_ns_per_mm = 0, coulomb_n = 0, quantum_mm = 0;
  double least_viscous_ns_per_mm = 0, least_coulomb_n = 0;
};

/// The text of such a file; `location` begins messages. Throws DeviceFileError, also for a mass
/// that is not positive definite.
[[nodiscard]] IdentifiedDevice parse_identified_device(std::string_view text,
                                                       const std::string& location);

/// Throws DeviceFileError.
[[nodiscard]] IdentifiedDevice read_identified_device(const std::filesystem::path& file);

/// `direction` has any length but 0.
[[nodiscard]] DeviceDirection along(const IdentifiedDevice& device,
                                    IdentifiedDevice::Axes direction);

}  // namespace kerf
