// SPDX-License-Identifier: Apache-2.0
#include <cstring>
#include <string_view>
#include <vector>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "shared/volume/checksum.hpp"

namespace kerf::hash_test {
namespace {

std::span<const std::byte> bytes_of(const auto& container) {
  return std::as_bytes(std::span(container.data(), container.size()));
}

std::uint32_t crc32c_bit_by_bit(std::span<const std::byte> bytes) {
  std::uint32_t crc = 0xffffffff;
  for (const std::byte byte : bytes) {
    crc ^= static_cast<std::uint32_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? crc >> 1 ^ 0x82f63b78 : crc >> 1;
  }
  return ~crc;
}

}  // namespace

TEST_CASE("crc32c gives the check value of the standard") {
  CHECK(crc32c(bytes_of(std::string_view("123456789"))) == 0xe3069283);
  CHECK(crc32c({}) == 0);
}

TEST_CASE("crc32c by eight bytes equals crc32c by bits") {
  CHECK(rc::check([](const std::vector<std::uint8_t>& data) {
    RC_ASSERT(crc32c(bytes_of(data)) == crc32c_bit_by_bit(bytes_of(data)));
  }));
}

}  // namespace kerf::hash_test
