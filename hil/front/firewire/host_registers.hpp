// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hil/front/firewire/iso_resources.hpp"

namespace kerf {

/// The asynchronous side of the host's own card: what the kernel's ohci.c answers where a program
/// asks the local node. Bytes are in the order of the bus; addresses count from kCsrBegin.
///
///     0x008   R   node id           0x21C   RL  bus manager
///     0x200   R   cycle timer       0x220   RL  bandwidth that is left
///     0x234   R   broadcast channel 0x224   RL  channels 0 to 31 that are free, channel 0 highest
///     0x400   R   configuration ROM 0x228   RL  channels 32 to 63
///
/// R: by a quadlet. L: by compare and swap of 32 bits, which answers with what was there. Not
/// modelled: writes, and reads of more than a quadlet.
[[nodiscard]] std::vector<std::uint32_t> host_config_rom();

/// An RCODE of the bus; `answer` is empty, or what the request returns. `timer`: the cycle timer.
[[nodiscard]] std::uint32_t ask_host(std::uint32_t tcode, std::uint64_t offset,
                                     std::span<const std::uint8_t> data, std::uint32_t timer,
                                     IsoResources& resources, std::vector<std::uint8_t>& answer);

}  // namespace kerf
