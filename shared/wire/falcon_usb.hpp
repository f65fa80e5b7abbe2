// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

/// How the Novint Falcon is reached and started over USB: an FTDI FT232R (full speed) in front of a
/// signal processor whose firmware the host sends after every power-up.
///
/// Start: purge, kBoot settings, RTS low, DTR low then high, send kBootHello, expect
/// kBootHelloReply (up to kBootTries answers, some with a leading zero), DTR low, kUploadDivisor,
/// send kUploadBegin and expect it back, then the firmware in chunks of kUploadChunk bytes, each
/// byte echoed; then the settings of kRun. Source: libnifalcon. The firmware itself is not part of
/// this project.
namespace kerf::falcon {

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
inline constexpr std::uint16_t kFtdiDtrLow = 0x0100;  // the upper byte says which line is meant
inline constexpr std::uint16_t kFtdiDtrHigh = 0x0101;
inline constexpr std::uint16_t kFtdiRtsLow = 0x0200;
inline constexpr std::uint16_t kFtdiNoFlowControl = 0;
inline constexpr std::uint16_t kFtdi8N1 = 0x0008;

// Settings while the device boots, while it takes its firmware, and while it runs.
inline constexpr std::uint16_t kBootLatencyMs = 16;
inline constexpr std::uint16_t kBootDivisor = 0x4138;  ///< 9600 baud
inline constexpr std::uint16_t kUploadDivisor = 0x15;  ///< about 140 kbaud
inline constexpr std::uint16_t kRunLatencyMs = 1;
inline constexpr std::uint16_t kRunDivisor = 2;  ///< 1.5 Mbaud

// The boot loader's words.
inline constexpr std::array<std::uint8_t, 3> kBootHello{0x0A, 0x43, 0x0D};
inline constexpr std::array<std::uint8_t, 4> kBootHelloReply{0x0A, 0x44, 0x2C, 0x0D};
inline constexpr int kBootTries = 100;
inline constexpr std::array<std::uint8_t, 1> kUploadBegin{0x41};
inline constexpr std::size_t kUploadChunk = 62;

}  // namespace kerf::falcon
