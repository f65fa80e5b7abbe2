// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "shared/wire/falcon_constants.hpp"

/// The two packets of the Novint Falcon's firmware, byte by byte, for both ends: 16 printable
/// bytes.
///
///      0  '<'
///      1  3 x 4 nibbles of signed 16-bit numbers, low nibble first, each + 'A'
///     13  info + 'A'   host -> device: 1 homing, 2 green, 4 blue, 8 red light
///                      device -> host: 1 plus, 2 forward, 4 centre, 8 minus button;
///                                      16, 32, 64 axis 1..3 is homed
///     14  'A'          spare
///     15  '>'
///
/// Host and device take turns: one answer to each packet of the host. Any thread; nothing
/// allocates, blocks or throws.
namespace kerf {

/// What the device says. Counts as they came; before its axis is homed a count has no meaning, and
/// it jumps when it becomes homed.
struct FalconReport {
  std::array<std::int16_t, 3> encoder{};
  std::uint8_t buttons = 0;  ///< falcon::kButton...; the upper four bits stay zero
  std::array<bool, 3> homed{};

  friend constexpr bool operator==(const FalconReport&, const FalconReport&) noexcept = default;
};

/// What the host asks for.
struct FalconCommand {
  /// Motor torques in counts, +-falcon::kMotorCountMax; encoding saturates.
  std::array<std::int16_t, 3> motor{};
  bool homing = false;  ///< must stand in every packet until all axes are homed
  bool green = false;
  bool blue = false;
  bool red = false;

  friend constexpr bool operator==(const FalconCommand&, const FalconCommand&) noexcept = default;
};

namespace falcon {

using PacketBytes = std::array<std::uint8_t, kPacketBytes>;

// Buttons of the grip.
inline constexpr std::uint8_t kButtonPlus = 1;
inline constexpr std::uint8_t kButtonForward = 2;
inline constexpr std::uint8_t kButtonCentre = 4;
inline constexpr std::uint8_t kButtonMinus = 8;
inline constexpr std::uint8_t kButtonMask = 15;
inline constexpr unsigned kHomedShift = 4;

// Lights and homing of a command.
inline constexpr std::uint8_t kInfoHoming = 1;
inline constexpr std::uint8_t kInfoGreen = 2;
inline constexpr std::uint8_t kInfoBlue = 4;
inline constexpr std::uint8_t kInfoRed = 8;

inline constexpr std::uint8_t kBegin = 0x3C;  ///< '<'
inline constexpr std::uint8_t kEnd = 0x3E;    ///< '>'
inline constexpr std::uint8_t kBias = 0x41;   ///< 'A'
inline constexpr std::size_t kInfoAt = 13;
inline constexpr std::size_t kSpareAt = 14;

/// Frame, numbers and info of either packet.
[[nodiscard]] constexpr PacketBytes pack(const std::array<std::int16_t, 3>& numbers,
                                         unsigned info) noexcept {
  PacketBytes bytes{};
  bytes[0] = kBegin;
  for (std::size_t nibble = 0; nibble < 12; ++nibble) {
    const auto number = static_cast<std::uint16_t>(numbers[nibble / 4]);
    bytes[1 + nibble] = static_cast<std::uint8_t>((number >> 4 * (nibble % 4) & 0xF) + kBias);
  }
  bytes[kInfoAt] = static_cast<std::uint8_t>(info + kBias);
  bytes[kSpareAt] = kBias;
  bytes[15] = kEnd;
  return bytes;
}

struct Unpacked {
  std::array<std::int16_t, 3> numbers{};
  unsigned info = 0;
};

/// Nothing unless these are 16 bytes from '<' to '>' with twelve nibbles and an info of at most
/// `max_info`. The spare byte is not looked at.
[[nodiscard]] constexpr std::optional<Unpacked> unpack(std::span<const std::uint8_t> bytes,
                                                       unsigned max_info) noexcept {
  if (bytes.size() != kPacketBytes || bytes[0] != kBegin || bytes[15] != kEnd) return std::nullopt;
  Unpacked packet;
  std::array<unsigned, 3> numbers{};
  for (std::size_t nibble = 0; nibble < 12; ++nibble) {
    const unsigned value = bytes[1 + nibble] - unsigned{kBias};  // below 'A' wraps to a large one
    if (value > 0xF) return std::nullopt;
    numbers[nibble / 4] |= value << 4 * (nibble % 4);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    packet.numbers[i] = static_cast<std::int16_t>(static_cast<std::uint16_t>(numbers[i]));
  }
  packet.info = bytes[kInfoAt] - unsigned{kBias};
  if (packet.info > max_info) return std::nullopt;
  return packet;
}

/// Device side. Nothing unless these are the 16 bytes of a command.
[[nodiscard]] constexpr std::optional<FalconCommand> decode_command(
    std::span<const std::uint8_t> bytes) noexcept {
  const auto packet = unpack(bytes, kInfoHoming | kInfoGreen | kInfoBlue | kInfoRed);
  if (!packet) return std::nullopt;
  const auto has = [&](unsigned bit) { return (packet->info & bit) != 0; };
  return FalconCommand{packet->numbers, has(kInfoHoming), has(kInfoGreen), has(kInfoBlue),
                       has(kInfoRed)};
}

/// Host side. Nothing unless these are the 16 bytes of a report.
[[nodiscard]] constexpr std::optional<FalconReport> decode_report(
    std::span<const std::uint8_t> bytes) noexcept {
  const auto packet = unpack(bytes, 0x7F);
  if (!packet) return std::nullopt;
  FalconReport report;
  report.encoder = packet->numbers;
  report.buttons = static_cast<std::uint8_t>(packet->info & kButtonMask);
  for (std::size_t i = 0; i < 3; ++i) {
    report.homed[i] = (packet->info >> (kHomedShift + i) & 1) != 0;
  }
  return report;
}

}  // namespace falcon

/// Host side.
[[nodiscard]] constexpr falcon::PacketBytes encode(const FalconCommand& command) noexcept {
  std::array<std::int16_t, 3> motor = command.motor;
  for (std::int16_t& count : motor) {
    count = static_cast<std::int16_t>(
        std::clamp<int>(count, -falcon::kMotorCountMax, falcon::kMotorCountMax));
  }
  return falcon::pack(motor, (command.homing ? unsigned{falcon::kInfoHoming} : 0u) |
                                 (command.green ? unsigned{falcon::kInfoGreen} : 0u) |
                                 (command.blue ? unsigned{falcon::kInfoBlue} : 0u) |
                                 (command.red ? unsigned{falcon::kInfoRed} : 0u));
}

/// Device side.
[[nodiscard]] constexpr falcon::PacketBytes encode(const FalconReport& report) noexcept {
  unsigned info = report.buttons & falcon::kButtonMask;
  for (std::size_t i = 0; i < 3; ++i) {
    info |= (report.homed[i] ? 1u : 0u) << (falcon::kHomedShift + i);
  }
  return falcon::pack(report.encoder, info);
}

}  // namespace kerf
