// SPDX-License-Identifier: Apache-2.0
#include "shared/segment/hash.hpp"

#include <cstring>
#include <string_view>
#include <vector>

#include <doctest/doctest.h>
#include <rapidcheck.h>

using namespace kerf;

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

TEST_CASE("the hash of a volume sees every change of one voxel") {
  CHECK(rc::check([](std::vector<Density> density) {
    RC_PRE(!density.empty());
    const std::uint64_t before = density_hash(density);
    const auto place = *rc::gen::inRange<std::size_t>(0, density.size());
    density[place] = static_cast<Density>(density[place] ^ *rc::gen::inRange(1, 65536));
    RC_ASSERT(density_hash(density) != before);
  }));
}

TEST_CASE("the hash of a box depends on what is inside and on nothing outside") {
  const VoxelGrid grid{13, 9, 7};
  std::vector<Density> density(grid.voxel_count(), 7);
  const VoxelBox box{{2, 3, 1}, {11, 6, 4}};
  const std::uint64_t before = box_hash(density, grid, box);
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = 0; y < grid.ny; ++y) {
      for (std::int32_t x = 0; x < grid.nx; ++x) {
        const bool in_box = x >= 2 && x < 11 && y >= 3 && y < 6 && z >= 1 && z < 4;
        Density& voxel = density[grid.index(x, y, z)];
        voxel = 8;
        CHECK((box_hash(density, grid, box) != before) == in_box);
        voxel = 7;
      }
    }
  }
}
