// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace kerf::bridge {

/// The part of one held block in a set hash; the hash is their sum mod 2^64 over all held blocks,
/// so it does not depend on the order, and a new version costs one difference. Two sets of versions
/// with one hash are as unlikely as two equal random 64-bit numbers.
[[nodiscard]] constexpr std::uint64_t block_hash(std::uint32_t id, std::uint64_t version,
                                                 std::uint64_t session) noexcept {
  std::uint64_t z = (version ^ session) * 0x9e3779b97f4a7c15 + id * 0xd1342543de82ef95 + 1;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  return z ^ (z >> 31);
}

/// `hash` after block `id` went from version `old` (0: not held) to `version`.
[[nodiscard]] constexpr std::uint64_t with_block(std::uint64_t hash, std::uint32_t id,
                                                 std::uint64_t old, std::uint64_t version,
                                                 std::uint64_t session) noexcept {
  if (old != 0) hash -= block_hash(id, old, session);
  return hash + block_hash(id, version, session);
}

}  // namespace kerf::bridge
