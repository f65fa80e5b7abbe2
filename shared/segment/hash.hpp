// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "shared/segment/layout.hpp"

namespace kerf {

/// CRC-32C (Castagnoli, reflected, start and end inverted), eight bytes per step. No allocation.
[[nodiscard]] std::uint32_t crc32c(std::span<const std::byte> bytes) noexcept;

/// The checksum that a tick record carries: over everything between its sequence number and it.
[[nodiscard]] std::uint32_t tick_record_crc(const TickRecord& record) noexcept;

}  // namespace kerf
