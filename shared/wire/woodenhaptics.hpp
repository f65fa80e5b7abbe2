// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>

#include "shared/wire/little_endian.hpp"

// WoodenHaptics, an open-hardware arm: geometry and motors, USB, HID reports.

/// Links, capstans, motors and USB.
///
/// mm, rad and counts. Frame of the device: x right, y up, z to the user (the makers' y, z, x).
/// Angles are absolute: A turns the arm about the vertical, to the right; B leans the upper link
/// out from the vertical; C lifts the forearm outwards from straight down (its motor works through
/// a parallel linkage). With r = Lb sin B + Lc sin C:
///
///     x = sin A r      y = Ln + Lb cos B - Lc cos C - Cy      z = cos A r - Cz
///
/// The same structure as the Omni's, with A = -q1, B = pi/2 - q2, C = q3. Source: the makers'
/// haptikfabriken API, for one build; builders may change the plans.
namespace kerf::wooden {

inline constexpr double kPi = std::numbers::pi;

// Links.
inline constexpr double kShoulderHeightMm = 80.0;  ///< Ln
inline constexpr double kUpperLinkMm = 205.0;      ///< Lb
inline constexpr double kForearmMm = 245.0;        ///< Lc
inline constexpr double kOriginHeightMm = 80.0;    ///< Cy: the origin lies this far above the base
inline constexpr double kOriginDepthMm = 220.0;    ///< Cz: and this far in front of it

// Motors and their encoders drive the bodies by capstans: angle = kRadPerCount[i] * count.
inline constexpr int kCountsPerRev = 2000;  ///< of the motor
inline constexpr double kCapstanMm = 10.0;  ///< diameter, as kBodyMm
inline constexpr std::array<double, 3> kBodyMm{160.0, 120.0, 120.0};
inline constexpr std::array<double, 3> kRadPerCount{
    2.0 * kPi / kCountsPerRev * (kCapstanMm / kBodyMm[0]),
    2.0 * kPi / kCountsPerRev*(kCapstanMm / kBodyMm[1]),
    2.0 * kPi / kCountsPerRev*(kCapstanMm / kBodyMm[2])};
/// Counts a, b, c in the pose in which the arm is calibrated: A = B = 0, C = pi/2.
inline constexpr std::array<std::int16_t, 3> kHomeCounts{0, 0, 6000};

/// Torque of a motor, N mm per A, by the plans of 2015. A positive current raises the count.
inline constexpr std::array<double, 3> kTorqueNmmPerA2015{25.9, 25.9, 25.9};
inline constexpr int kMaxMilliamps = 2000;        ///< limit in the makers' host software
inline constexpr int kAmplifierMilliamps = 3000;  ///< at full duty of the firmware

/// The firmware switches the amplifiers off after this time without a report from the host.
inline constexpr double kWatchdogS = 0.5;

// USB. mbed firmware: 14 bytes in both directions; Teensy raw HID: 64 bytes, of which the first 14
// are used.
inline constexpr std::uint16_t kMbedVendorId = 0x1234;
inline constexpr std::uint16_t kMbedProductId = 0x0006;
inline constexpr std::uint16_t kTeensyVendorId = 0x16C0;
inline constexpr std::uint16_t kTeensyProductId = 0x0486;
inline constexpr std::uint16_t kUsagePage = 0xFFAB;
inline constexpr std::uint16_t kUsage = 0x0200;
inline constexpr std::size_t kPacketBytes = 14;
inline constexpr std::size_t kLongPacketBytes = 64;
/// ID of the only report of each direction. hidraw expects it before the packet in a write, and
/// does not return it in a read.
inline constexpr std::uint8_t kReportId = 0;

}  // namespace kerf::wooden

/// The two HID reports, byte by byte, for host and device: seven little-endian i16, in 14 bytes or
/// at the beginning of 64.
///
///     device -> host                       host -> device
///      0  encoders a, b, c                  0  motor currents a, b, c in mA
///      6  encoders d, e, f (a gimbal)       6  0 = currents, 1 = set the encoders
///     12  1 = calibration button            8  0, or new counts of a, b, c if 6 is 1
///
/// The report ID, wooden::kReportId, is not part of these bytes. Any thread; no function allocates,
/// blocks or throws.
namespace kerf {

/// Device to host. Raw counts: the low 16 bits of the firmware's.
struct WoodenReport {
  std::array<std::int16_t, 6> encoder{};
  bool calibrate = false;  ///< the button was pressed; stays set until the encoders are set

  friend constexpr bool operator==(const WoodenReport&, const WoodenReport&) noexcept = default;
};

/// Host to device.
struct WoodenCommand {
  /// +-wooden::kMaxMilliamps; `encode` saturates. Ignored if `set_encoders` has a value: the motors
  /// then get no current.
  std::array<std::int16_t, 3> milliamps{};
  std::optional<std::array<std::int16_t, 6>> set_encoders;  ///< new counts of a to f

  friend constexpr bool operator==(const WoodenCommand&, const WoodenCommand&) noexcept = default;
};

namespace wooden {

/// The long packet; the short one is its first kPacketBytes.
using PacketBytes = std::array<std::uint8_t, kLongPacketBytes>;

inline constexpr std::int16_t kCommandCurrents = 0;
inline constexpr std::int16_t kCommandSetEncoders = 1;
inline constexpr std::size_t kInfoAt = 12;
inline constexpr std::size_t kCommandAt = 6;
inline constexpr std::size_t kAttributesAt = 8;

[[nodiscard]] constexpr bool is_packet_size(std::size_t bytes) noexcept {
  return bytes == kPacketBytes || bytes == kLongPacketBytes;
}

// A variant with a wireless button adds kButtonCounts to encoder d while the button is pressed. The
// gimbal's own counts stay within half of that.
inline constexpr int kButtonCounts = 10000;
[[nodiscard]] constexpr bool wireless_button(std::int16_t encoder_d) noexcept {
  return encoder_d > kButtonCounts / 2;
}

/// Device side. nullopt unless `bytes` is a command of 14 or 64 bytes; ignores all after the first
/// 14.
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

/// Host side. nullopt unless there are 14 or 64 bytes and the button is 0 or 1. That also refuses
/// the firmware that fills 64 bytes with text.
[[nodiscard]] constexpr std::optional<WoodenReport> decode_report(
    std::span<const std::uint8_t> bytes) noexcept {
  if (!is_packet_size(bytes.size())) return std::nullopt;
  const std::uint16_t button = wire::get_u16(bytes, kInfoAt);
  if (button > 1) return std::nullopt;
  WoodenReport report;
  for (std::size_t i = 0; i < 6; ++i) report.encoder[i] = wire::get_i16(bytes, 2 * i);
  report.calibrate = button == 1;
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
