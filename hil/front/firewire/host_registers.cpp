// SPDX-License-Identifier: Apache-2.0
#include "hil/front/firewire/host_registers.hpp"

#include <array>
#include <cstddef>
#include <optional>

#include <linux/firewire-cdev.h>

#include "hil/front/firewire/config_rom.hpp"

namespace kerf {
namespace {

constexpr std::uint64_t kNodeIds = kCsrBegin + 0x008;
constexpr std::uint64_t kCycleTime = kCsrBegin + 0x200;
constexpr std::uint64_t kBusManagerId = kCsrBegin + 0x21C;  // the first of four
constexpr std::uint64_t kBroadcastChannel = kCsrBegin + 0x234;
constexpr std::uint32_t kBroadcast31 = 0x8000'001F;  // valid; the channel that it always is
constexpr std::size_t kSwapBytes = 8;                // what is expected, what is to be there

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
