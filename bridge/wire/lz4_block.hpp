// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace kerf::bridge {

/// Most bytes that `pack` writes for `raw` ones.
[[nodiscard]] std::size_t packed_bound(std::size_t raw) noexcept;

/// Writes `raw`, at most `kMaxRawBytes`, as one LZ4 block to `out` of `packed_bound` bytes; returns
/// its length.
[[nodiscard]] std::size_t pack(std::span<const std::byte> raw, std::span<std::byte> out) noexcept;

/// True where `packed` decodes to exactly as many bytes as `out` has. Safe for any bytes.
[[nodiscard]] bool unpack(std::span<const std::byte> packed, std::span<std::byte> out) noexcept;

}  // namespace kerf::bridge
