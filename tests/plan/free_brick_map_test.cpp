// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/tables/free_brick_map.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <vector>

#include <doctest/doctest.h>

using namespace kerf;

TEST_CASE("bricks tell how far the nearest brick with density is") {
  const VoxelGrid grid{45, 22, 31};  // no whole number of bricks on any axis
  std::mt19937 random(4);
  for (const int dense : {0, 1, 3, 20}) {
    std::vector<Density> density(grid.voxel_count(), 99);
    std::vector<VoxelIndex> solid;
    for (int i = 0; i < dense; ++i) {
      const VoxelIndex at{static_cast<std::int32_t>(random() % 45),
                          static_cast<std::int32_t>(random() % 22),
                          static_cast<std::int32_t>(random() % 31)};
      density[grid.index(at.x, at.y, at.z)] = 100;
      solid.push_back(at);
    }
    const FreeBrickMap map(grid, density, 100);
    const FreeBricks bricks = map.bricks();
    CHECK(map.bytes() == 23 * 11 * 16);
    for (std::int32_t z = 0; z < grid.nz; ++z) {
      for (std::int32_t y = 0; y < grid.ny; ++y) {
        for (std::int32_t x = 0; x < grid.nx; ++x) {
          int nearest = 255;
          for (const VoxelIndex& s : solid) {
            nearest =
                std::min(nearest, std::max({std::abs(s.x / 2 - x / 2), std::abs(s.y / 2 - y / 2),
                                            std::abs(s.z / 2 - z / 2)}));
          }
          if (bricks.at(x, y, z) != nearest) REQUIRE(bricks.at(x, y, z) == nearest);
        }
      }
    }
    // Outside: that of the nearest brick inside.
    CHECK(bricks.at(-100, 3, 1000) == bricks.at(0, 3, 30));
  }
  CHECK(FreeBricks{}.at(1, 2, 3) == 0);
}

TEST_CASE("enough free bricks keep every voxel that a sample reads free") {
  CHECK(free_bricks_for(0.5) == 2);
  CHECK(free_bricks_for(1) == 2);
  CHECK(free_bricks_for(1.01) == 3);
  CHECK(free_bricks_for(3) == 3);
  CHECK(free_bricks_for(3.5) == 4);
}
