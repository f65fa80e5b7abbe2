// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace kerf {

/// What a fault of a sensor can touch in any device's report.
struct Readings {
  std::array<std::int16_t, 3> encoder{};
  bool parked =
      false;          ///< docked (Omni), centre button (Falcon), calibration button (WoodenHaptics)
  bool homed = true;  ///< of the Falcon
  std::array<std::uint16_t, 6> pots{};  ///< of the Omni's gimbal

  friend bool operator==(const Readings&, const Readings&) noexcept = default;
};

/// Nothing where `packet` is no report of a device; which one it comes from shows by its size.
[[nodiscard]] std::optional<Readings> readings_of(std::span<const std::uint8_t> packet) noexcept;

/// Puts `readings` into a packet that `readings_of` has read.
void put_readings(const Readings& readings, std::span<std::uint8_t> packet) noexcept;

}  // namespace kerf
