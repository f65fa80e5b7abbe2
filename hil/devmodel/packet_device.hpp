// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

namespace kerf {

/// A device as a front sees it: packets in, bus cycles of 125 us, packets out. Called by one
/// thread.
class PacketDevice {
 public:
  virtual ~PacketDevice() = default;

  /// A packet of the host as it came; what is no command is counted and ignored.
  virtual void receive(std::span<const std::uint8_t> packet) noexcept = 0;
  virtual void advance(int cycles) noexcept = 0;
  /// The packet that is due now, valid until the next call; empty when the device says nothing
  /// (more). Several may be due after one `advance`.
  [[nodiscard]] virtual std::span<const std::uint8_t> next_packet() noexcept = 0;
};

}  // namespace kerf
