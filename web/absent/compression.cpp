// SPDX-License-Identifier: Apache-2.0
// Messages to a page of the same machine are never packed: what LZ4 would pack stays as it is.
#include "bridge/wire/compression.hpp"

#include <algorithm>

namespace kerf::bridge {

std::size_t packed_bound(std::size_t raw) noexcept {
  return raw;
}

std::size_t pack(std::span<const std::byte> raw, std::span<std::byte> out) noexcept {
  std::copy(raw.begin(), raw.end(), out.begin());
  return raw.size();
}

/// A viewer of this run never receives a packed message.
bool unpack(std::span<const std::byte>, std::span<std::byte>) noexcept {
  return false;
}

bool append_payload(std::span<const std::byte> raw, double, PackChoice&,
                    std::vector<std::byte>& out) {
  out.insert(out.end(), raw.begin(), raw.end());
  return false;
}

}  // namespace kerf::bridge
