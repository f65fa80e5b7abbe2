// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>

// The Novint Falcon: geometry and motors, packets, framing of the serial stream, start over USB.

/// Geometry, encoders and motors.
///
/// mm, rad and counts. Frame of the device: x right, y up, z to the user; its origin lies on the
/// axis of the three legs, kOriginDepthMm in front of the plane of their hips. Letters as in
/// Stamper's thesis on this kind of delta arm. One leg, in its own frame (u away from the axis, v
/// across, w towards the user); p is the position of the grip relative to the plane of the hips:
///
///     (u, v, w) = Rz(-azimuth) p - (r, s, 0)
///     knee  = a (cos t1, sin t1) in the plane of u and w
///     shin  = from the knee over d + e + b sin t3 in that plane to (u + c, w)
///     cos t3 = (v + f) / b
///
/// t1 is the joint that has the encoder and the motor.
///
/// Source: the open driver libnifalcon, whose authors measured one device. By them a count of zero
/// is "about" 35 degrees, so that angle differs between units.
namespace kerf::falcon {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kRadPerDegree = kPi / 180.0;

// Legs.
inline constexpr double kThighMm = 60.0;      ///< a
inline constexpr double kShinMm = 102.5;      ///< b
inline constexpr double kPlateOutMm = 14.43;  ///< c: from the centre of the grip to a shin, along u
inline constexpr double kShinEndMm = 11.25;   ///< d
inline constexpr double kKneeEndMm = 11.25;   ///< e
inline constexpr double kPlateAcrossMm = -25.0;  ///< f: the same, along v
inline constexpr double kHipOutMm = 40.0;        ///< r
inline constexpr double kHipAcrossMm = -23.09;   ///< s
inline constexpr std::array<double, 3> kLegAzimuthRad{
    // about z, from x towards y
    105.0 * kRadPerDegree, -15.0 * kRadPerDegree, -135.0 * kRadPerDegree};
/// Device z = 0 is p.z = 125 mm: no pose within kReachMm of it is near a singular one.
inline constexpr double kOriginDepthMm = 125.0;
inline constexpr double kReachMm = 55.0;

// Joint encoders: t1 = kZeroRad + kRadPerCount * count, once homed.
inline constexpr double kShaftMm = 14.25;  ///< diameter of the motor shaft, which has the encoder
inline constexpr double kThighWheelMm = 110.0;  ///< diameter of the wheel that it drives
inline constexpr int kShaftCountsPerRev = 4 * 320;
inline constexpr double kCountsPerRev = kShaftCountsPerRev * kThighWheelMm / kShaftMm;
inline constexpr double kRadPerCount = 2.0 * kPi / kCountsPerRev;
inline constexpr double kZeroRad = 35.0 * kRadPerDegree;

// Motors: signed counts. A positive count turns the thigh towards smaller t1 (the open driver
// negates J^T F). Torque per count is unknown; by the open driver's factor of 1e4 it is 0.1 N mm.
inline constexpr int kMotorCountMax = 4096;
inline constexpr int kMotorSign = -1;
inline constexpr double kOpenDriverNmmPerCount = 0.1;

// Packets.
inline constexpr std::size_t kPacketBytes = 16;  ///< in both directions

}  // namespace kerf::falcon

/// The two packets of the firmware, byte by byte, for host and device: 16 printable bytes each.
///
///      0  '<'
///      1  3 x 4 nibbles of signed 16-bit numbers, low nibble first, each + 'A'
///     13  info + 'A'   host -> device: 1 homing, 2 green, 4 blue, 8 red light
///                      device -> host: 1 plus, 2 forward, 4 centre, 8 minus button;
///                                      16, 32, 64 axis 1..3 is homed
///     14  'A'          spare
///     15  '>'
///
/// The device sends one report for each command of the host. Any thread; no function allocates,
/// blocks or throws.
namespace kerf {

/// Device to host. Raw counts; homing an axis makes its count jump, and before that the count has
/// no absolute meaning.
struct FalconReport {
  std::array<std::int16_t, 3> encoder{};
  std::uint8_t buttons = 0;  ///< falcon::kButton...; the upper four bits stay zero
  std::array<bool, 3> homed{};

  friend constexpr bool operator==(const FalconReport&, const FalconReport&) noexcept = default;
};

/// Host to device.
struct FalconCommand {
  /// Motor torques in counts, +-falcon::kMotorCountMax; encoding saturates.
  std::array<std::int16_t, 3> motor{};
  bool homing = false;  ///< must be set in every packet until all axes are homed
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

/// Makes either packet from its numbers and info.
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

/// nullopt unless `bytes` has 16 bytes from '<' to '>' with twelve valid nibbles, an info of at
/// most `max_info` and the spare byte.
[[nodiscard]] constexpr std::optional<Unpacked> unpack(std::span<const std::uint8_t> bytes,
                                                       unsigned max_info) noexcept {
  if (bytes.size() != kPacketBytes || bytes[0] != kBegin || bytes[15] != kEnd) return std::nullopt;
  if (bytes[kSpareAt] != kBias) return std::nullopt;
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

/// Device side. nullopt unless `bytes` is a command of 16 bytes.
[[nodiscard]] constexpr std::optional<FalconCommand> decode_command(
    std::span<const std::uint8_t> bytes) noexcept {
  const auto packet = unpack(bytes, kInfoHoming | kInfoGreen | kInfoBlue | kInfoRed);
  if (!packet) return std::nullopt;
  const auto has = [&](unsigned bit) { return (packet->info & bit) != 0; };
  return FalconCommand{packet->numbers, has(kInfoHoming), has(kInfoGreen), has(kInfoBlue),
                       has(kInfoRed)};
}

/// Host side. nullopt unless `bytes` is a report of 16 bytes.
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

namespace kerf::falcon {

/// Finds packets, '<' to '>', in a serial stream. For host and device; one thread; no allocation.
class Framer {
 public:
  /// Takes the next byte of the stream. Returns true if it ends a packet, which `packet` returns
  /// until the next call.
  [[nodiscard]] bool take(std::uint8_t byte) noexcept {
    if (byte == kBegin) {  // never inside a packet, whose bytes are 'A' and above
      strays_ += size_;
      size_ = 0;
    } else if (size_ == 0) {
      ++strays_;
      return false;
    }
    packet_[size_++] = byte;
    if (size_ < kPacketBytes) return false;
    size_ = 0;
    if (byte == kEnd) return true;
    strays_ += kPacketBytes;
    return false;
  }
  [[nodiscard]] const PacketBytes& packet() const noexcept { return packet_; }
  /// Bytes that belonged to no packet.
  [[nodiscard]] std::uint64_t strays() const noexcept { return strays_; }

 private:
  PacketBytes packet_{};
  std::size_t size_ = 0;
  std::uint64_t strays_ = 0;
};

// USB: an FTDI FT232R (full speed) and behind it a signal processor, to which the host uploads the
// firmware after every power-up.
//
// Start: purge, kBoot settings, RTS low, DTR low then high, send kBootHello, expect
// kBootHelloReply (within kBootTries answers, some with a leading zero), DTR low, kUploadDivisor,
// send kUploadBegin and expect it back, then the firmware in chunks of kUploadChunk bytes, of which
// each byte is echoed; then the kRun settings. Source: libnifalcon. The firmware itself is not part
// of this project.

inline constexpr std::uint16_t kVendorId = 0x0403;
inline constexpr std::uint16_t kProductId = 0xCB48;
inline constexpr std::uint8_t kEndpointOut = 0x02;  ///< bulk
inline constexpr std::uint8_t kEndpointIn = 0x81;   ///< bulk; every 64-byte packet begins with ...
inline constexpr std::size_t kFtdiStatusBytes = 2;  ///< ... two bytes of modem and line status
inline constexpr std::size_t kFtdiPacketBytes = 64;

// Control requests to the FTDI chip: vendor, to the device, no data.
inline constexpr std::uint8_t kFtdiRequestType = 0x40;
enum class FtdiRequest : std::uint8_t {
  reset = 0,  ///< value: kFtdiReset, kFtdiPurgeRx, kFtdiPurgeTx
  modem = 1,  ///< value: kFtdiDtrLow ... kFtdiRtsLow
  flow = 2,
  baud = 3,    ///< value: divisor
  data = 4,    ///< value: kFtdi8N1
  latency = 9  ///< value: ms
};
inline constexpr std::uint16_t kFtdiReset = 0;
inline constexpr std::uint16_t kFtdiPurgeRx = 1;
inline constexpr std::uint16_t kFtdiPurgeTx = 2;
inline constexpr std::uint16_t kFtdiDtrLow = 0x0100;  // the upper byte selects the line
inline constexpr std::uint16_t kFtdiDtrHigh = 0x0101;
inline constexpr std::uint16_t kFtdiRtsLow = 0x0200;
inline constexpr std::uint16_t kFtdiNoFlowControl = 0;
inline constexpr std::uint16_t kFtdi8N1 = 0x0008;

// Settings while the device boots, during the upload of the firmware, and while it runs.
inline constexpr std::uint16_t kBootLatencyMs = 16;
inline constexpr std::uint16_t kBootDivisor = 0x4138;  ///< 9600 baud
inline constexpr std::uint16_t kUploadDivisor = 0x15;  ///< about 140 kbaud
inline constexpr std::uint16_t kRunLatencyMs = 1;
inline constexpr std::uint16_t kRunDivisor = 2;  ///< 1.5 Mbaud

// Messages of the boot loader.
inline constexpr std::array<std::uint8_t, 3> kBootHello{0x0A, 0x43, 0x0D};
inline constexpr std::array<std::uint8_t, 4> kBootHelloReply{0x0A, 0x44, 0x2C, 0x0D};
inline constexpr int kBootTries = 100;
inline constexpr std::array<std::uint8_t, 1> kUploadBegin{0x41};
inline constexpr std::size_t kUploadChunk = 62;

}  // namespace kerf::falcon
