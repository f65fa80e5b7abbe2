// SPDX-License-Identifier: Apache-2.0

#include "bridge/wire/compression.hpp"

#include <cstdint>

#include <lz4.h>

#include "shared/posix/monotonic_clock.hpp"

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

bool append_payload(std::span<const std::byte> raw, double bytes_per_s, PackChoice& choice,
                    std::vector<std::byte>& out) {
  const std::size_t at = out.size();
  if (!raw.empty() && choice.pays(bytes_per_s)) {
    out.resize(at + packed_bound(raw.size()));
    const std::int64_t begin_ns = monotonic_ns();
    const std::size_t packed = pack(raw, std::span(out).subspan(at));
    choice.saw(raw.size(), packed, monotonic_ns() - begin_ns);
    if (packed < raw.size()) {
      out.resize(at + packed);
      return true;
    }
    out.resize(at);
  }
  out.insert(out.end(), raw.begin(), raw.end());
  return false;
}

}  // namespace kerf::bridge
