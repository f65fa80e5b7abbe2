// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/device/driver/device_driver.hpp"

namespace kerf {

/// The Omni: a stream of reports, counted by the device itself. The inkwell's light: steady once
/// calibrated, slow flash while waiting for the stylus, fast flash in a fault.
class OmniDriver final : public DeviceDriver {
 public:
  using DeviceDriver::DeviceDriver;

 private:
  [[nodiscard]] bool take(std::span<const std::uint8_t> packet,
                          DeviceReport& report) noexcept override;
  [[nodiscard]] std::size_t compose(const ServoOutput& output, Packet& packet) noexcept override;
  [[nodiscard]] std::size_t compose_release(Packet& packet) const noexcept override;

  bool seen_ = false;
};

}  // namespace kerf
