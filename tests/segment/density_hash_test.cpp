// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdint>
#include <vector>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "shared/volume/checksum.hpp"

namespace kerf::density_hash_test {

TEST_CASE("the hash of a volume is a known number on every machine") {
  std::vector<Density> density(1003);  // whole rounds of four words, one word, a part of a word
  for (std::size_t i = 0; i < density.size(); ++i) density[i] = static_cast<Density>(i * 40503);
  CHECK(density_hash(density) == 0x9fa35749b4a0968a);
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

}  // namespace kerf::density_hash_test
