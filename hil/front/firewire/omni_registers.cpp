// SPDX-License-Identifier: Apache-2.0
#include "hil/front/firewire/omni_registers.hpp"

#include <cstddef>

#include <linux/firewire-constants.h>

namespace kerf {
namespace {

constexpr std::uint32_t kVendor = 0x000B99;
constexpr std::uint64_t kRomBegin = 0xFFFF'F000'0400;

constexpr std::uint64_t kListenChannel = 0x1000;
constexpr std::uint64_t kTransmitChannel = 0x1001;
constexpr std::uint64_t kUnknownZero = 0x1082;
constexpr std::uint64_t kUnknownC0 = 0x1083;
constexpr std::uint64_t kControl = 0x1087;
constexpr std::uint64_t kMode20010 = 0x20010;
constexpr std::uint64_t kGuidHigh = 0x1006'000C;
constexpr std::uint64_t kGuidLow = 0x1006'0010;

/// CRC-16 of IEEE 1212 over whole quadlets.
std::uint32_t crc16(std::span<const std::uint32_t> quadlets) noexcept {
  std::uint32_t crc = 0;
  for (const std::uint32_t data : quadlets) {
    for (int shift = 28; shift >= 0; shift -= 4) {
      const std::uint32_t sum = (crc >> 12 ^ data >> shift) & 0xF;
      crc = (crc << 4 ^ sum << 12 ^ sum << 5 ^ sum) & 0xFFFF;
    }
  }
  return crc;
}

void put_quadlet(std::span<std::uint8_t> out, std::uint32_t value) noexcept {
  for (std::size_t i = 0; i < 4; ++i) out[i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
}

}  // namespace

std::vector<std::uint32_t> OmniRegisters::config_rom() const {
  constexpr std::uint32_t kInfoQuadlets = 4;
  constexpr std::uint32_t kDirectoryQuadlets = 2;
  std::vector<std::uint32_t> rom{
      0,
      0x3133'3934,     // "1394"
      0x0064'6002,     // no bus master, 512-byte blocks, S400
      kVendor << 8,    // GUID
      packed_serial_,  //
      0,               // root directory:
      0x0300'0000 | kVendor,
      0x1700'0000,  // model 0: the ROM does not tell an Omni from its siblings
  };
  rom[0] = kInfoQuadlets << 24 | kInfoQuadlets << 16 | crc16(std::span(rom).subspan(1, 4));
  rom[5] = kDirectoryQuadlets << 16 | crc16(std::span(rom).subspan(6));
  return rom;
}

std::uint32_t OmniRegisters::read(std::uint64_t offset, std::span<std::uint8_t> data) const {
  const auto byte = [&](std::uint8_t value) -> std::uint32_t {
    if (data.size() != 1) return RCODE_TYPE_ERROR;
    data[0] = value;
    return RCODE_COMPLETE;
  };
  const auto quadlet = [&](std::uint32_t value) -> std::uint32_t {
    if (data.size() != 4) return RCODE_TYPE_ERROR;
    put_quadlet(data, value);
    return RCODE_COMPLETE;
  };
  switch (offset) {
    case kTransmitChannel:
      return byte(transmit_channel_);
    case kUnknownZero:
      return byte(0x00);
    case kUnknownC0:
      return byte(0xC0);
    case kControl:
      return byte(control_);
    case kGuidHigh:
      return quadlet(kVendor << 8);
    case kGuidLow:
      return quadlet(packed_serial_);
    default:
      break;
  }
  const std::vector<std::uint32_t> rom = config_rom();
  const std::uint64_t in_rom = offset - kRomBegin;
  if (in_rom >= rom.size() * 4 || in_rom % 4 != 0) return RCODE_ADDRESS_ERROR;
  return quadlet(rom[in_rom / 4]);
}

std::uint32_t OmniRegisters::write(std::uint64_t offset, std::span<const std::uint8_t> data) {
  const auto byte = [&](std::uint8_t& target, std::uint8_t mask) -> std::uint32_t {
    if (data.size() != 1) return RCODE_TYPE_ERROR;
    target = data[0] & mask;
    return RCODE_COMPLETE;
  };
  switch (offset) {
    case kListenChannel:
      return byte(listen_channel_, 0x7F);  // 0x40 is written, too, as a test of life
    case kTransmitChannel:
      return byte(transmit_channel_, 0x7F);
    case kControl:
      return byte(control_, 0xFF);
    case kMode20010:
      if (data.size() != 4) return RCODE_TYPE_ERROR;
      mode_20010_ = static_cast<std::uint32_t>(data[0]) << 24 |
                    static_cast<std::uint32_t>(data[1]) << 16 |
                    static_cast<std::uint32_t>(data[2]) << 8 | data[3];
      return RCODE_COMPLETE;
    default:
      return RCODE_ADDRESS_ERROR;
  }
}

}  // namespace kerf
