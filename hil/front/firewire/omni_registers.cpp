// SPDX-License-Identifier: Apache-2.0
#include "hil/front/firewire/omni_registers.hpp"

#include <array>
#include <cstddef>

#include <linux/firewire-constants.h>

#include "hil/front/firewire/config_rom.hpp"

namespace kerf {
namespace {

constexpr std::uint32_t kVendor = 0x000B99;

constexpr std::uint64_t kListenChannel = 0x1000;
constexpr std::uint64_t kTransmitChannel = 0x1001;
constexpr std::uint64_t kUnknownZero = 0x1082;
constexpr std::uint64_t kUnknownC0 = 0x1083;
constexpr std::uint64_t kControl = 0x1087;
constexpr std::uint64_t kMode20010 = 0x20010;
constexpr std::uint64_t kGuidHigh = 0x1006'000C;
constexpr std::uint64_t kGuidLow = 0x1006'0010;

}  // namespace

std::vector<std::uint32_t> OmniRegisters::config_rom() const {
  constexpr std::uint32_t kAbilities = 0x0064'6002;  // no bus master, 512-byte blocks, S400
  // Model 0: the ROM does not tell an Omni from its siblings.
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

}  // namespace kerf
