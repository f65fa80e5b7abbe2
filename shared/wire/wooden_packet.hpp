// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "shared/wire/little_endian.hpp"
#include "shared/wire/wooden_constants.hpp"

/// The two HID reports of the WoodenHaptics arm, byte by byte, for both ends: seven little-endian
/// i16, in 14 bytes or at the beginning of 64.
///
///     device -> host                       host -> device
///      0  encoders a, b, c                  0  motor currents a, b, c in mA
///      6  encoders d, e, f (a gimbal)       6  0 = currents, 1 = set the encoders
///     12  1 = calibration button            8  0, or new counts of a, b, c; those of d, e, f
///                                              then stand in place of the currents
///
/// The number of the report, wooden::kReportId, is no part of these bytes. Any thread; nothing
/// allocates, blocks or throws.
namespace kerf {

/// What the device says. Counts as they came, 16 bits of what the firmware counts.
struct WoodenReport {
  std::array<std::int16_t, 6> encoder{};
  bool calibrate = false;  ///< the button was pressed; stays until the encoders are set

  friend constexpr bool operator==(const WoodenReport&, const WoodenReport&) noexcept = default;
};

/// What the host asks for.
struct WoodenCommand {
  /// +-wooden::kMaxMilliamps; encoding saturates. Ignored where the encoders are set: the motors
  /// get no current then.
  std::array<std::int16_t, 3> milliamps{};
  std::optional<std::array<std::int16_t, 6>> set_encoders;

  friend constexpr bool operator==(const WoodenCommand&, const WoodenCommand&) noexcept = default;
};

namespace wooden {

/// The long form; the short one is its first kPacketBytes.
using PacketBytes = std::array<std::uint8_t, kLongPacketBytes>;

inline constexpr std::int16_t kCommandCurrents = 0;
inline constexpr std::int16_t kCommandSetEncoders = 1;
inline constexpr std::size_t kInfoAt = 12;
inline constexpr std::size_t kCommandAt = 6;
inline constexpr std::size_t kAttributesAt = 8;

[[nodiscard]] constexpr bool is_packet_size(std::size_t bytes) noexcept {
  return bytes == kPacketBytes || bytes == kLongPacketBytes;
}

// A variant with a wireless button adds kButtonCounts to encoder d while it is pressed; a gimbal's
// own counts stay within half of it.
inline constexpr int kButtonCounts = 10000;
[[nodiscard]] constexpr bool wireless_button(std::int16_t encoder_d) noexcept {
  return encoder_d > kButtonCounts / 2;
}

/// Device side. Nothing unless these are the 14 or 64 bytes of a command; what comes after the
/// first 14 is not looked at.
[[nodiscard]] constexpr std::optional<WoodenCommand> decode_command(
    std::span<const std::uint8_t> bytes) noexcept {
  if (!is_packet_size(bytes.size())) return std::nullopt;
  WoodenCommand command;
  const std::int16_t kind = wire::get_i16(bytes, kCommandAt);
  if (kind == kCommandCurrents) {
    for (std::size_t i = 0; i < 3; ++i) command.milliamps[i] = wire::get_i16(bytes, 2 * i);
    return command;
  }
  if (kind != kCommandSetEncoders) return std::nullopt;
  auto& counts = command.set_encoders.emplace();
  for (std::size_t i = 0; i < 3; ++i) {
    counts[i] = wire::get_i16(bytes, kAttributesAt + 2 * i);
    counts[3 + i] = wire::get_i16(bytes, 2 * i);
  }
  return command;
}

/// Host side. Nothing unless there are 14 or 64 bytes.
[[nodiscard]] constexpr std::optional<WoodenReport> decode_report(
    std::span<const std::uint8_t> bytes) noexcept {
  if (!is_packet_size(bytes.size())) return std::nullopt;
  WoodenReport report;
  for (std::size_t i = 0; i < 6; ++i) report.encoder[i] = wire::get_i16(bytes, 2 * i);
  report.calibrate = wire::get_i16(bytes, kInfoAt) == 1;
  return report;
}

}  // namespace wooden

/// Host side.
[[nodiscard]] constexpr wooden::PacketBytes encode(const WoodenCommand& command) noexcept {
  wooden::PacketBytes bytes{};
  for (std::size_t i = 0; i < 3; ++i) {
    if (command.set_encoders) {
      wire::put_i16(bytes, wooden::kAttributesAt + 2 * i, (*command.set_encoders)[i]);
      wire::put_i16(bytes, 2 * i, (*command.set_encoders)[3 + i]);
    } else {
      const int milliamps =
          std::clamp<int>(command.milliamps[i], -wooden::kMaxMilliamps, wooden::kMaxMilliamps);
      wire::put_i16(bytes, 2 * i, static_cast<std::int16_t>(milliamps));
    }
  }
  if (command.set_encoders) {
    wire::put_i16(bytes, wooden::kCommandAt, wooden::kCommandSetEncoders);
  }
  return bytes;
}

/// Device side.
[[nodiscard]] constexpr wooden::PacketBytes encode(const WoodenReport& report) noexcept {
  wooden::PacketBytes bytes{};
  for (std::size_t i = 0; i < 6; ++i) wire::put_i16(bytes, 2 * i, report.encoder[i]);
  wire::put_i16(bytes, wooden::kInfoAt, report.calibrate ? 1 : 0);
  return bytes;
}

}  // namespace kerf
