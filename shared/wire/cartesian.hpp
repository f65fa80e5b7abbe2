// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <span>

#include "shared/wire/little_endian.hpp"
#include "shared/wire/personality.hpp"

// Cartesian devices: they report a pose and take a force. kerf's own packets of them.

namespace kerf::cartesian {

/// nullopt for a joint-count device.
[[nodiscard]] constexpr std::optional<Figures> figures(Personality personality) noexcept {
  return kind_of(personality).axes;
}

/// One motor count of the servo is this force along one axis.
inline constexpr double kNewtonsPerCount = 0.001;

inline constexpr std::size_t kReportBytes = 40;
inline constexpr std::size_t kCommandBytes = 16;
inline constexpr std::uint32_t kReportMark = 0x3172636B;   // "kcr1": the last byte is the version
inline constexpr std::uint32_t kCommandMark = 0x3163636B;  // "kcc1"

/// A position beyond this on any axis is invalid, for instance because of a wrong unit.
inline constexpr int kFarthestUm = 1'000'000;
inline constexpr double kQuaternionOne = 32767;

}  // namespace kerf::cartesian

/// The two packets, byte by byte; little-endian.
///
///     device -> host, 40 bytes                     host -> device, 16 bytes
///      0  u32     mark "kcr1"                       0  u32     mark "kcc1"
///      4  u32     number of the report, from 1      4  i16 x3  force in mN; x, y, z
///      8  i32 x3  position in um; x, y, z          10  u8      1 = force on
///     20  i16 x4  orientation x, y, z, w / 32767   11  u8      0 asks the user, 1 ready, 2 fault
///     28  i16 x3  force that it exerts, in mN      12  u32     number of the newest report read
///     34  u8      bits: 1 first, 2 second button
///     35  u8      bits: 1 parked, 2 homed, 4 powered
///     36  u32     age of the pose when it was sent, in us; 0 = unknown
///
/// The orientation is that of the tool; at identity its shaft points up. Any thread; no function
/// allocates, blocks or throws.
namespace kerf {

/// Device to host.
struct CartesianReport {
  std::uint32_t number = 0;
  std::array<std::int32_t, 3> position_um{};
  std::array<std::int16_t, 4> orientation{0, 0, 0, 32767};
  std::array<std::int16_t, 3> force_mn{};
  bool button1 = false, button2 = false;
  bool parked = false;
  bool homed = false;    ///< the position is absolute
  bool powered = false;  ///< the device can exert a force
  std::uint32_t age_us = 0;

  friend constexpr bool operator==(const CartesianReport&,
                                   const CartesianReport&) noexcept = default;
};

/// Host to device.
struct CartesianCommand {
  enum class Light : std::uint8_t { asks, ready, fault };

  std::array<std::int16_t, 3> force_mn{};
  bool force_on = false;
  Light light = Light::asks;
  std::uint32_t answers = 0;  ///< number of the newest report read

  friend constexpr bool operator==(const CartesianCommand&,
                                   const CartesianCommand&) noexcept = default;
};

namespace cartesian {

using ReportBytes = std::array<std::uint8_t, kReportBytes>;
using CommandBytes = std::array<std::uint8_t, kCommandBytes>;

/// A quaternion, normalised, in the packet's format; nullopt if it is zero or not finite.
[[nodiscard]] inline std::optional<std::array<std::int16_t, 4>> packed_orientation(
    const std::array<double, 4>& xyzw) noexcept {
  const double square =
      xyzw[0] * xyzw[0] + xyzw[1] * xyzw[1] + xyzw[2] * xyzw[2] + xyzw[3] * xyzw[3];
  if (!(square > 1e-12 && square < 1e12)) return std::nullopt;
  const double scale = kQuaternionOne / std::sqrt(square);
  std::array<std::int16_t, 4> packed;
  for (std::size_t i = 0; i < 4; ++i) {
    packed[i] = static_cast<std::int16_t>(std::lround(xyzw[i] * scale));
  }
  return packed;
}

/// A coordinate in the packet's format; nullopt if it is not finite or beyond kFarthestUm.
[[nodiscard]] inline std::optional<std::int32_t> packed_mm(double mm) noexcept {
  if (!(std::abs(mm) <= kFarthestUm / 1000.0)) return std::nullopt;
  return static_cast<std::int32_t>(std::lround(mm * 1000.0));
}

/// A force component in the packet's format: NaN becomes 0, and larger values the end of the range.
[[nodiscard]] inline std::int16_t packed_n(double newtons) noexcept {
  constexpr double kEnd = 32767;
  const double mn = newtons / kNewtonsPerCount;
  return mn == mn ? static_cast<std::int16_t>(std::lround(std::clamp(mn, -kEnd, kEnd)))
                  : std::int16_t{0};
}

}  // namespace cartesian

[[nodiscard]] constexpr cartesian::ReportBytes encode(const CartesianReport& report) noexcept {
  cartesian::ReportBytes bytes{};
  wire::put_u32(bytes, 0, cartesian::kReportMark);
  wire::put_u32(bytes, 4, report.number);
  for (std::size_t i = 0; i < 3; ++i) {
    wire::put_u32(bytes, 8 + 4 * i, static_cast<std::uint32_t>(report.position_um[i]));
    wire::put_i16(bytes, 28 + 2 * i, report.force_mn[i]);
  }
  for (std::size_t i = 0; i < 4; ++i) wire::put_i16(bytes, 20 + 2 * i, report.orientation[i]);
  bytes[34] = static_cast<std::uint8_t>((report.button1 ? 1 : 0) | (report.button2 ? 2 : 0));
  bytes[35] = static_cast<std::uint8_t>((report.parked ? 1 : 0) | (report.homed ? 2 : 0) |
                                        (report.powered ? 4 : 0));
  wire::put_u32(bytes, 36, report.age_us);
  return bytes;
}

/// nullopt unless `bytes` is a report of 40 bytes with a position within kFarthestUm and an
/// orientation of length 1 within 1 %.
[[nodiscard]] constexpr std::optional<CartesianReport> decode_cartesian_report(
    std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() != cartesian::kReportBytes ||
      wire::get_u32(bytes, 0) != cartesian::kReportMark || bytes[34] > 3 || bytes[35] > 7) {
    return std::nullopt;
  }
  CartesianReport report;
  report.number = wire::get_u32(bytes, 4);
  for (std::size_t i = 0; i < 3; ++i) {
    report.position_um[i] = static_cast<std::int32_t>(wire::get_u32(bytes, 8 + 4 * i));
    report.force_mn[i] = wire::get_i16(bytes, 28 + 2 * i);
    if (report.position_um[i] < -cartesian::kFarthestUm ||
        report.position_um[i] > cartesian::kFarthestUm) {
      return std::nullopt;
    }
  }
  std::int64_t square = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    report.orientation[i] = wire::get_i16(bytes, 20 + 2 * i);
    square += std::int64_t{report.orientation[i]} * report.orientation[i];
  }
  constexpr std::int64_t kOne = 32767 * 32767;
  if (square < kOne * 98 / 100 || square > kOne * 102 / 100) return std::nullopt;
  report.button1 = (bytes[34] & 1) != 0;
  report.button2 = (bytes[34] & 2) != 0;
  report.parked = (bytes[35] & 1) != 0;
  report.homed = (bytes[35] & 2) != 0;
  report.powered = (bytes[35] & 4) != 0;
  report.age_us = wire::get_u32(bytes, 36);
  return report;
}

[[nodiscard]] constexpr cartesian::CommandBytes encode(const CartesianCommand& command) noexcept {
  cartesian::CommandBytes bytes{};
  wire::put_u32(bytes, 0, cartesian::kCommandMark);
  for (std::size_t i = 0; i < 3; ++i) wire::put_i16(bytes, 4 + 2 * i, command.force_mn[i]);
  bytes[10] = command.force_on ? 1 : 0;
  bytes[11] = static_cast<std::uint8_t>(command.light);
  wire::put_u32(bytes, 12, command.answers);
  return bytes;
}

/// nullopt unless `bytes` is a command of 16 bytes.
[[nodiscard]] constexpr std::optional<CartesianCommand> decode_cartesian_command(
    std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() != cartesian::kCommandBytes ||
      wire::get_u32(bytes, 0) != cartesian::kCommandMark || bytes[10] > 1 || bytes[11] > 2) {
    return std::nullopt;
  }
  CartesianCommand command;
  for (std::size_t i = 0; i < 3; ++i) command.force_mn[i] = wire::get_i16(bytes, 4 + 2 * i);
  command.force_on = bytes[10] == 1;
  command.light = static_cast<CartesianCommand::Light>(bytes[11]);
  command.answers = wire::get_u32(bytes, 12);
  return command;
}

}  // namespace kerf
