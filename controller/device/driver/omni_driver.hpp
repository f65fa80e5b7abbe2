// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "controller/device/driver/device_driver.hpp"

namespace kerf {

/// The Omni: a stream of reports, counted by the device itself. The inkwell's light: steady once
/// calibrated, slow flash while waiting for the stylus, fast flash in a fault.
///
/// A counter near the last one is believed: newer counts what is missing, older is an old packet. A
/// far one may be a wrong bit, so it waits for a second packet that continues it; the first is
/// refused then. A device that counts anew is found in the same way, and has lost nothing.
class OmniDriver final : public DeviceDriver {
 public:
  using DeviceDriver::DeviceDriver;

 private:
  [[nodiscard]] bool take(std::span<const std::uint8_t> packet,
                          DeviceReport& report) noexcept override;
  [[nodiscard]] std::size_t compose(const ServoOutput& output, Packet& packet) noexcept override;
  [[nodiscard]] std::size_t compose_release(Packet& packet) const noexcept override;

  /// Whether a packet of this counter is the newest; counts what is missing before it.
  [[nodiscard]] bool is_newest(std::uint32_t counter) noexcept;

  bool seen_ = false;
  std::uint32_t newest_ = 0;
  std::optional<std::uint32_t> far_;  ///< counter of the last packet, where it was far
};

}  // namespace kerf
