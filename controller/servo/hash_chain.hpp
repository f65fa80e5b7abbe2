// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace kerf {

inline constexpr std::uint64_t kHashSeed = 0xcbf29ce484222325;  // FNV-1a offset basis

/// FNV-1a over whole words: the same on every machine, whatever its byte order.
[[nodiscard]] constexpr std::uint64_t hash_word(std::uint64_t hash, std::uint64_t word) noexcept {
  return (hash ^ word) * 0x100000001b3;
}

}  // namespace kerf
