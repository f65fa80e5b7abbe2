// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "shared/wire/little_endian.hpp"

// The PHANTOM Omni: geometry and scales, packets.

/// Link lengths, scales and the pose in the inkwell.
///
/// mm, rad and counts. Frame of the device: x right, y up, z to the user; the tip is the centre of
/// the gimbal. Joints are absolute: q1 turret, q2 thigh, q3 forearm against the base (its motor and
/// its encoder work through a parallel linkage). With r = L1 cos q2 + L2 sin q3:
///
///     x = -sin q1 r      y = L1 sin q2 - L2 cos q3 + Cy      z = cos q1 r - Cz
///
/// Link offsets and the pose in the inkwell differ between units; these are the defaults of a
/// configuration.
namespace kerf::omni {

inline constexpr double kPi = 3.14159265358979323846;

inline constexpr std::uint32_t kVendorOui = 0x000B99;  ///< SensAble, in the configuration ROM

// Links.
inline constexpr double kUpperLinkMm = 133.35;    ///< L1
inline constexpr double kForearmMm = 133.35;      ///< L2
inline constexpr double kOriginHeightMm = 23.35;  ///< Cy: the origin is this far below the shoulder
inline constexpr double kOriginDepthMm = 168.35;  ///< Cz: and this far in front of it
inline constexpr std::array<double, 3> kDockRad{0.0, 0.23, -0.37};  ///< q in the inkwell

// Joint encoders: q_i = dock_i + sign_i * kRadPerCount * (count_i - count in the inkwell).
inline constexpr int kCountsPerRev = 15000;
inline constexpr double kRadPerCount = 2.0 * kPi / kCountsPerRev;
inline constexpr std::array<int, 3> kEncoderSign{1, -1, 1};

// Gimbal: angle_i = slope_i * r + offset_i with r = A / (A + B); order yaw, pitch, roll.
inline constexpr std::array<double, 3> kGimbalSlopeRad{5.48, -5.28, 4.76};
inline constexpr std::array<double, 3> kGimbalOffsetRad{-2.74, 2.64, -2.38};
inline constexpr int kPotNoiseBits = 5;  ///< the lowest bits of each pot are noise

// Motors: 12 bits, offset binary.
inline constexpr int kMotorZero = 0x7FF;  ///< DAC word of no torque
inline constexpr int kMotorWordMax = 0xFFF;
inline constexpr int kMotorCountMin = -kMotorZero;
inline constexpr int kMotorCountMax = kMotorWordMax - kMotorZero;

// Isochronous packets.
inline constexpr std::size_t kCommandBytes = 16;  ///< host to device
inline constexpr std::size_t kReportBytes = 44;   ///< device to host
inline constexpr int kBusCyclesPerSecond = 8000;

}  // namespace kerf::omni

/// The two isochronous packets, byte by byte, for host and device.
///
///     host -> device, 16 bytes            device -> host, 44 bytes
///      0  u16 x3  motors, 0x7FF = none     0  u16 x2  0x0000, 0x001E
///      6  u16     0x53C0 | lights | on     4  i16 x3  joint encoders, wrap at 16 bits
///      8  u32 x2  zero                    10  u16 x3  gimbal pots, wiper A
///                                         19  u8      buttons, inkwell: 0 = pressed, docked
///                                         20  u16     0x1007
///                                         22  u16 x3  gimbal pots, wiper B
///                                         28  u16     "FW"
///                                         32  u32     packet counter
///                                         40  u32     a second counter at half the rate
///
/// Little-endian. Any thread; no function allocates, blocks or throws. Bytes that are not listed
/// have no known meaning: they are written as zero and ignored when read.
namespace kerf {

/// Device to host. Raw counts, without calibration or filter.
struct OmniReport {
  std::array<std::int16_t, 3> encoder{};
  std::array<std::uint16_t, 3> pot_a{};  ///< yaw, pitch, roll
  std::array<std::uint16_t, 3> pot_b{};
  bool button1 = false;  ///< true = pressed
  bool button2 = false;
  bool docked = false;
  std::uint32_t counter = 0;  ///< +1 per packet; a gap is a loss

  friend constexpr bool operator==(const OmniReport&, const OmniReport&) noexcept = default;
};

/// Host to device.
struct OmniCommand {
  enum class Light : std::uint8_t { off = 0, slow_flash = 1, fast_flash = 2, steady = 3 };

  /// Joint torques in signed DAC counts, kMotorCountMin..kMotorCountMax; `encode` saturates.
  std::array<std::int16_t, 3> motor{};
  bool motors_on = false;
  Light light = Light::off;  ///< of the inkwell

  friend constexpr bool operator==(const OmniCommand&, const OmniCommand&) noexcept = default;
};

namespace omni {

using CommandBytes = std::array<std::uint8_t, kCommandBytes>;
using ReportBytes = std::array<std::uint8_t, kReportBytes>;

// Status word of a command.
inline constexpr std::uint16_t kStatusBase = 0x53C0;  ///< always set; meaning unknown
inline constexpr std::uint16_t kStatusLightMask = 0x0003;
inline constexpr std::uint16_t kStatusMotorsOn = 0x0008;

// Status byte of a report: a cleared bit means pressed or docked.
inline constexpr std::uint8_t kButton1Up = 0x01;
inline constexpr std::uint8_t kButton2Up = 0x02;
inline constexpr std::uint8_t kUndocked = 0x04;

// Words that have the same value in every recorded trace.
inline constexpr std::uint16_t kReportMark = 0x001E;
inline constexpr std::uint16_t kReportFlags = 0x1007;
inline constexpr std::uint16_t kReportFw = 0x5746;

}  // namespace omni

/// Host side.
[[nodiscard]] constexpr omni::CommandBytes encode(const OmniCommand& command) noexcept {
  omni::CommandBytes bytes{};
  for (std::size_t i = 0; i < 3; ++i) {
    const int word = std::clamp(command.motor[i] + omni::kMotorZero, 0, omni::kMotorWordMax);
    wire::put_u16(bytes, 2 * i, static_cast<std::uint16_t>(word));
  }
  const auto light = static_cast<unsigned>(command.light);
  const unsigned on = command.motors_on ? omni::kStatusMotorsOn : 0u;
  wire::put_u16(bytes, 6, static_cast<std::uint16_t>(omni::kStatusBase | light | on));
  return bytes;
}

/// Device side. nullopt unless `bytes` is a command of 16 bytes: motor words of 12 bits, the known
/// status pattern and zeros at the end.
[[nodiscard]] constexpr std::optional<OmniCommand> decode_command(
    std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() != omni::kCommandBytes) return std::nullopt;
  OmniCommand command;
  for (std::size_t i = 0; i < 3; ++i) {
    const int word = wire::get_u16(bytes, 2 * i);
    if (word > omni::kMotorWordMax) return std::nullopt;
    command.motor[i] = static_cast<std::int16_t>(word - omni::kMotorZero);
  }
  const unsigned status = wire::get_u16(bytes, 6);
  constexpr unsigned kVariable = omni::kStatusLightMask | omni::kStatusMotorsOn;
  if ((status & ~kVariable) != omni::kStatusBase) return std::nullopt;
  if (wire::get_u32(bytes, 8) != 0 || wire::get_u32(bytes, 12) != 0) return std::nullopt;
  command.light = static_cast<OmniCommand::Light>(status & omni::kStatusLightMask);
  command.motors_on = (status & omni::kStatusMotorsOn) != 0;
  return command;
}

/// Device side.
[[nodiscard]] constexpr omni::ReportBytes encode(const OmniReport& report) noexcept {
  omni::ReportBytes bytes{};
  wire::put_u16(bytes, 2, omni::kReportMark);
  for (std::size_t i = 0; i < 3; ++i) {
    wire::put_i16(bytes, 4 + 2 * i, report.encoder[i]);
    wire::put_u16(bytes, 10 + 2 * i, report.pot_a[i]);
    wire::put_u16(bytes, 22 + 2 * i, report.pot_b[i]);
  }
  bytes[19] = static_cast<std::uint8_t>((report.button1 ? 0 : omni::kButton1Up) |
                                        (report.button2 ? 0 : omni::kButton2Up) |
                                        (report.docked ? 0 : omni::kUndocked));
  wire::put_u16(bytes, 20, omni::kReportFlags);
  wire::put_u16(bytes, 28, omni::kReportFw);
  wire::put_u32(bytes, 32, report.counter);
  wire::put_u32(bytes, 40, report.counter / 2);
  return bytes;
}

/// Host side. nullopt unless `bytes` has 44 bytes with the words that every trace has.
[[nodiscard]] constexpr std::optional<OmniReport> decode_report(
    std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() != omni::kReportBytes) return std::nullopt;
  if (wire::get_u16(bytes, 0) != 0 || wire::get_u16(bytes, 2) != omni::kReportMark ||
      wire::get_u16(bytes, 20) != omni::kReportFlags ||
      wire::get_u16(bytes, 28) != omni::kReportFw) {
    return std::nullopt;
  }
  OmniReport report;
  for (std::size_t i = 0; i < 3; ++i) {
    report.encoder[i] = wire::get_i16(bytes, 4 + 2 * i);
    report.pot_a[i] = wire::get_u16(bytes, 10 + 2 * i);
    report.pot_b[i] = wire::get_u16(bytes, 22 + 2 * i);
  }
  report.button1 = (bytes[19] & omni::kButton1Up) == 0;
  report.button2 = (bytes[19] & omni::kButton2Up) == 0;
  report.docked = (bytes[19] & omni::kUndocked) == 0;
  report.counter = wire::get_u32(bytes, 32);
  return report;
}

}  // namespace kerf
