// SPDX-License-Identifier: Apache-2.0
#include "shared/segment/hash.hpp"

#include <array>
#include <cstring>

namespace kerf {
namespace {

using CrcTable = std::array<std::array<std::uint32_t, 256>, 8>;

// table[k][b]: effect of byte b followed by k zero bytes.
constexpr CrcTable kCrcTable = [] {
  constexpr std::uint32_t kPolynomial = 0x82f63b78;  // Castagnoli, reflected
  CrcTable table{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1) != 0 ? kPolynomial : 0);
    table[0][byte] = crc;
  }
  for (std::size_t k = 1; k < table.size(); ++k) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint32_t before = table[k - 1][byte];
      table[k][byte] = before >> 8 ^ table[0][before & 0xff];
    }
  }
  return table;
}();

}  // namespace

std::uint32_t crc32c(std::span<const std::byte> bytes) noexcept {
  std::uint32_t crc = 0xffffffff;
  std::size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, 8);
    word ^= crc;
    crc = 0;
    for (std::size_t k = 0; k < 8; ++k) crc ^= kCrcTable[7 - k][word >> (8 * k) & 0xff];
  }
  for (; i < bytes.size(); ++i) {
    crc = crc >> 8 ^ kCrcTable[0][(crc ^ static_cast<std::uint32_t>(bytes[i])) & 0xff];
  }
  return ~crc;
}

std::uint32_t tick_record_crc(const TickRecord& record) noexcept {
  constexpr std::size_t kFirst = offsetof(TickRecord, tick);
  return crc32c(
      std::as_bytes(std::span(&record, 1)).subspan(kFirst, offsetof(TickRecord, crc32c) - kFirst));
}

}  // namespace kerf
