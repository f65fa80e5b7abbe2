// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

/// Little-endian numbers in a packet, on hosts of any byte order. The caller makes sure that the
/// bytes exist.
namespace kerf::wire {

[[nodiscard]] constexpr std::uint16_t get_u16(std::span<const std::uint8_t> bytes,
                                              std::size_t at) noexcept {
  return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8);
}
constexpr void put_u16(std::span<std::uint8_t> bytes, std::size_t at, std::uint16_t v) noexcept {
  bytes[at] = static_cast<std::uint8_t>(v & 0xFF);
  bytes[at + 1] = static_cast<std::uint8_t>(v >> 8);
}
[[nodiscard]] constexpr std::int16_t get_i16(std::span<const std::uint8_t> bytes,
                                             std::size_t at) noexcept {
  return static_cast<std::int16_t>(get_u16(bytes, at));
}
constexpr void put_i16(std::span<std::uint8_t> bytes, std::size_t at, std::int16_t v) noexcept {
  put_u16(bytes, at, static_cast<std::uint16_t>(v));
}
[[nodiscard]] constexpr std::uint32_t get_u32(std::span<const std::uint8_t> bytes,
                                              std::size_t at) noexcept {
  return get_u16(bytes, at) | static_cast<std::uint32_t>(get_u16(bytes, at + 2)) << 16;
}
constexpr void put_u32(std::span<std::uint8_t> bytes, std::size_t at, std::uint32_t v) noexcept {
  put_u16(bytes, at, static_cast<std::uint16_t>(v & 0xFFFF));
  put_u16(bytes, at + 2, static_cast<std::uint16_t>(v >> 16));
}

}  // namespace kerf::wire
