// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace kerf {

/// A control request to a USB device, as on the bus (USB 2.0, 9.3).
struct UsbSetup {
  static constexpr std::size_t kBytes = 8;

  std::uint8_t type = 0;
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  std::uint16_t index = 0;
  std::uint16_t length = 0;
};

[[nodiscard]] inline UsbSetup setup_of(std::span<const std::uint8_t, UsbSetup::kBytes> b) noexcept {
  const auto word = [&](std::size_t at) {
    return static_cast<std::uint16_t>(b[at] | b[at + 1] << 8);
  };
  return {b[0], b[1], word(2), word(4), word(6)};
}

// What descriptors are written from.
constexpr int low(std::uint16_t value) noexcept {
  return value & 0xFF;
}
constexpr int high(std::uint16_t value) noexcept {
  return value >> 8;
}
/// Each value is one byte, 0..255.
template <class... Values>
[[nodiscard]] constexpr std::array<std::uint8_t, sizeof...(Values)> usb_bytes(
    Values... values) noexcept {
  return {static_cast<std::uint8_t>(values)...};
}

}  // namespace kerf
