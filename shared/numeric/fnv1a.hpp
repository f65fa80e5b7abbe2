// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

namespace kerf {

/// FNV-1a, 64 bits (Fowler, Noll and Vo). Distinguishes contents; not safe against collisions made
/// on purpose. The same on every machine, with either byte order.
inline constexpr std::uint64_t kFnv1aBasis = 0xcbf29ce484222325;

/// One step with a byte, as the standard has it, or with a whole word: eight times fewer steps, and
/// another hash.
[[nodiscard]] constexpr std::uint64_t fnv1a_step(std::uint64_t hash, std::uint64_t word) noexcept {
  return (hash ^ word) * 0x100000001b3;
}

/// The `count` lowest bytes of a word, low byte first.
[[nodiscard]] constexpr std::uint64_t fnv1a_bytes(std::uint64_t hash, std::uint64_t word,
                                                  int count = 8) noexcept {
  for (int i = 0; i < count; ++i) hash = fnv1a_step(hash, word >> (8 * i) & 0xff);
  return hash;
}

[[nodiscard]] constexpr std::uint64_t fnv1a(std::string_view text,
                                            std::uint64_t hash = kFnv1aBasis) noexcept {
  for (const char c : text) hash = fnv1a_step(hash, static_cast<unsigned char>(c));
  return hash;
}

}  // namespace kerf
