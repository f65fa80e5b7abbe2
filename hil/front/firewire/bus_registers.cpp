// SPDX-License-Identifier: Apache-2.0
#include "hil/front/firewire/bus_registers.hpp"

#include <array>
#include <cstddef>
#include <optional>

#include <linux/firewire-cdev.h>
#include <linux/firewire-constants.h>

namespace kerf {
namespace {

// Configuration ROMs (IEEE 1212): quadlets in the order of this machine, as GET_INFO returns them.

constexpr std::uint64_t kCsrBegin = 0xFFFF'F000'0000;
constexpr std::uint64_t kRomBegin = kCsrBegin + 0x400;

/// CRC-16 of IEEE 1212 over whole quadlets.
constexpr std::uint32_t rom_crc(std::span<const std::uint32_t> quadlets) noexcept {
  std::uint32_t crc = 0;
  for (const std::uint32_t data : quadlets) {
    for (int shift = 28; shift >= 0; shift -= 4) {
      const std::uint32_t sum = (crc >> 12 ^ data >> shift) & 0xF;
      crc = (crc << 4 ^ sum << 12 ^ sum << 5 ^ sum) & 0xFFFF;
    }
  }
  return crc;
}

/// Whole ROM of a node: its capabilities (the second quadlet of its information), its GUID, and the
/// entries of its root directory.
std::vector<std::uint32_t> make_rom(std::uint32_t abilities, std::uint32_t guid_high,
                                    std::uint32_t guid_low,
                                    std::span<const std::uint32_t> directory) {
  constexpr std::uint32_t kInfoQuadlets = 4;
  constexpr std::uint32_t kName = 0x3133'3934;  // "1394"
  std::vector<std::uint32_t> rom{0, kName, abilities, guid_high, guid_low, 0};
  rom.insert(rom.end(), directory.begin(), directory.end());
  rom[0] =
      kInfoQuadlets << 24 | kInfoQuadlets << 16 | rom_crc(std::span(rom).subspan(1, kInfoQuadlets));
  rom[5] = static_cast<std::uint32_t>(directory.size()) << 16 | rom_crc(directory);
  return rom;
}

/// A number in the order of the bus.
void put_quadlet(std::span<std::uint8_t> out, std::uint32_t value) noexcept {
  for (std::size_t i = 0; i < 4; ++i) out[i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
}
std::uint32_t get_quadlet(std::span<const std::uint8_t> in) noexcept {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | in[i];
  return value;
}

/// A read of one quadlet; an RCODE of the bus.
std::uint32_t read_rom(std::span<const std::uint32_t> rom, std::uint64_t offset,
                       std::span<std::uint8_t> data) {
  const std::uint64_t in_rom = offset - kRomBegin;
  if (in_rom >= rom.size() * 4 || in_rom % 4 != 0) return RCODE_ADDRESS_ERROR;
  if (data.size() != 4) return RCODE_TYPE_ERROR;
  put_quadlet(data, rom[in_rom / 4]);
  return RCODE_COMPLETE;
}

// Registers of the Omni.

constexpr std::uint32_t kVendor = 0x000B99;

constexpr std::uint64_t kListenChannel = 0x1000;
constexpr std::uint64_t kTransmitChannel = 0x1001;
constexpr std::uint64_t kUnknownZero = 0x1082;
constexpr std::uint64_t kUnknownC0 = 0x1083;
constexpr std::uint64_t kControl = 0x1087;
constexpr std::uint64_t kMode20010 = 0x20010;
constexpr std::uint64_t kGuidHigh = 0x1006'000C;
constexpr std::uint64_t kGuidLow = 0x1006'0010;

// Registers of the host's card.

constexpr std::uint64_t kNodeIds = kCsrBegin + 0x008;
constexpr std::uint64_t kCycleTime = kCsrBegin + 0x200;
constexpr std::uint64_t kBusManagerId = kCsrBegin + 0x21C;  // the first of four
constexpr std::uint64_t kBroadcastChannel = kCsrBegin + 0x234;
constexpr std::uint32_t kBroadcast31 = 0x8000'001F;  // valid; the channel that it always is
constexpr std::size_t kSwapBytes = 8;                // the expected value, then the new one

std::optional<IsoResources::Register> manager_register(std::uint64_t offset) noexcept {
  const std::uint64_t place = offset - kBusManagerId;
  if (place % 4 != 0 || place / 4 > 3) return std::nullopt;
  return static_cast<IsoResources::Register>(place / 4);
}

std::optional<std::uint32_t> plain_register(std::uint64_t offset, std::uint32_t timer) noexcept {
  switch (offset) {
    case kNodeIds:
      return kHostNodeId << 16;
    case kCycleTime:
      return timer;
    case kBroadcastChannel:
      return kBroadcast31;
    default:
      return std::nullopt;
  }
}

}  // namespace

std::vector<std::uint32_t> OmniRegisters::config_rom() const {
  constexpr std::uint32_t kAbilities = 0x0064'6002;  // no bus master, 512-byte blocks, S400
  // Model 0: the ROM does not distinguish an Omni from its siblings.
  constexpr std::array<std::uint32_t, 2> kDirectory{0x0300'0000 | kVendor, 0x1700'0000};
  return make_rom(kAbilities, kVendor << 8, packed_serial_, kDirectory);
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
  return read_rom(config_rom(), offset, data);
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

std::vector<std::uint32_t> host_config_rom() {
  // Resource manager, cycle master, isochronous, bus manager; 2048 bytes, S400.
  constexpr std::uint32_t kAbilities = 0xF000'A202;
  constexpr std::uint32_t kLinux = 0x001F11;
  constexpr std::array<std::uint32_t, 3> kDirectory{0x0C00'83C0, 0x0300'0000 | kLinux, 0x1702'3901};
  return make_rom(kAbilities, kLinux << 8, 1, kDirectory);
}

std::uint32_t ask_host(std::uint32_t tcode, std::uint64_t offset,
                       std::span<const std::uint8_t> data, std::uint32_t timer,
                       IsoResources& resources, std::vector<std::uint8_t>& answer) {
  answer.assign(4, 0);
  std::uint32_t rcode = RCODE_ADDRESS_ERROR;
  const bool reads = tcode == TCODE_READ_QUADLET_REQUEST;
  if (const auto which = manager_register(offset)) {
    rcode = RCODE_COMPLETE;
    if (reads) {
      put_quadlet(answer, resources.get(*which));
    } else if (tcode == TCODE_LOCK_COMPARE_SWAP && data.size() == kSwapBytes) {
      put_quadlet(answer, resources.compare_swap(*which, get_quadlet(data.first(4)),
                                                 get_quadlet(data.subspan(4))));
    } else {
      rcode = RCODE_TYPE_ERROR;
    }
  } else if (const auto value = plain_register(offset, timer)) {
    rcode = reads ? RCODE_COMPLETE : RCODE_TYPE_ERROR;
    put_quadlet(answer, *value);
  } else {
    rcode = read_rom(host_config_rom(), offset, answer);
    if (rcode == RCODE_COMPLETE && !reads) rcode = RCODE_TYPE_ERROR;
  }
  if (rcode != RCODE_COMPLETE) answer.clear();
  return rcode;
}

}  // namespace kerf
