// SPDX-License-Identifier: Apache-2.0
#include "bridge/wire/lz4_block.hpp"

#include <lz4.h>

namespace kerf::bridge {
namespace {

const char* chars(const std::byte* at) {
  return reinterpret_cast<const char*>(at);
}
char* chars(std::byte* at) {
  return reinterpret_cast<char*>(at);
}

}  // namespace

std::size_t packed_bound(std::size_t raw) noexcept {
  return static_cast<std::size_t>(LZ4_compressBound(static_cast<int>(raw)));
}

std::size_t pack(std::span<const std::byte> raw, std::span<std::byte> out) noexcept {
  return static_cast<std::size_t>(LZ4_compress_default(chars(raw.data()), chars(out.data()),
                                                       static_cast<int>(raw.size()),
                                                       static_cast<int>(out.size())));
}

bool unpack(std::span<const std::byte> packed, std::span<std::byte> out) noexcept {
  const int length =
      LZ4_decompress_safe(chars(packed.data()), chars(out.data()), static_cast<int>(packed.size()),
                          static_cast<int>(out.size()));
  return length >= 0 && static_cast<std::size_t>(length) == out.size();
}

}  // namespace kerf::bridge
