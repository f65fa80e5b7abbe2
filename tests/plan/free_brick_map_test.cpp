// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/tables/free_brick_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <doctest/doctest.h>

using namespace kerf;

namespace {

/// Voxels between what brick b holds, 2b to 2b + 2, and where voxel v is read, v - 1 to v + 1.
double between(int brick, int voxel) {
  return std::max({0, voxel - 1 - (2 * brick + 2), 2 * brick - (voxel + 1)});
}

int steps_between(const VoxelIndex& brick, const VoxelIndex& voxel) {
  const double distance =
      std::hypot(between(brick.x, voxel.x), between(brick.y, voxel.y), between(brick.z, voxel.z));
  return std::min(254, static_cast<int>(4 * distance + 1e-9));
}

}  // namespace

TEST_CASE("bricks tell how far the nearest voxel with density is read") {
  std::mt19937 random(4);
  // No whole number of bricks, farther than the map can say, hardly a volume, and one where
  // something is near everywhere.
  for (const VoxelGrid grid : {VoxelGrid{45, 22, 31}, {161, 7, 90}, {1, 2, 3}, {9, 10, 8}}) {
    for (const int dense : {0, 1, 3, 20, grid.voxel_count() < 1000 ? 90 : 2}) {
      std::vector<Density> density(grid.voxel_count(), 99);
      std::vector<VoxelIndex> solid;
      const auto any = [&](std::int32_t n) {
        return static_cast<std::int32_t>(random() % static_cast<unsigned>(n));
      };
      for (int i = 0; i < dense; ++i) {
        const VoxelIndex at{any(grid.nx), any(grid.ny), any(grid.nz)};
        density[grid.index(at.x, at.y, at.z)] = 100;
        solid.push_back(at);
      }
      const FreeBrickMap map(grid, density, 100);
      const FreeSpaceMap bricks = map.bricks();
      CHECK(map.bytes() == bricks.grid.voxel_count());
      for (std::int32_t z = 0; z < grid.nz; ++z) {
        for (std::int32_t y = 0; y < grid.ny; ++y) {
          for (std::int32_t x = 0; x < grid.nx; ++x) {
            int nearest = 254;
            for (const VoxelIndex& s : solid) {
              nearest = std::min(nearest, steps_between({x / 2, y / 2, z / 2}, s));
            }
            if (bricks.at(x, y, z) != nearest) REQUIRE(bricks.at(x, y, z) == nearest);
          }
        }
      }
      // Outside: that of the nearest brick inside, or the way to where something may be read.
      CHECK(bricks.at(-1, 1, 1) == bricks.at(0, 1, 1));
      CHECK(bricks.at(-6, 1, 1) == std::max(bricks.at(0, 1, 1), 5 * kFreeSteps));
      CHECK(bricks.at(-100, 1, 1000) == kFreeFarthest);
    }
  }
  CHECK(FreeSpaceMap{}.at(1, 2, 3) == 0);
}

TEST_CASE("a volume is free where nothing is read, or nothing near a voxel of the iso") {
  std::mt19937 random(8);
  constexpr VoxelGrid kGrid{39, 20, 26};
  constexpr Density kIso = 800;
  int soft_alone = 0;
  for (const int solid : {0, 1, 3}) {
    std::vector<Density> density(kGrid.voxel_count(), 0);
    const auto any = [&] { return static_cast<std::size_t>(random()) % density.size(); };
    for (int i = 0; i < 40; ++i) density[any()] = static_cast<Density>(99 + random() % 700);
    for (int i = 0; i < solid; ++i) density[any()] = kIso;
    const MappedField mapped(kGrid, density, kIso);
    const DensityField field = mapped.field();
    const FreeBrickMap felt(kGrid, density, kIso / 8), bearing(kGrid, density, kIso);
    for (std::int32_t z = 0; z < kGrid.nz; ++z) {
      for (std::int32_t y = 0; y < kGrid.ny; ++y) {
        for (std::int32_t x = 0; x < kGrid.nx; ++x) {
          const std::int32_t unread = felt.bricks().at(x, y, z);
          const std::int32_t free = std::max(unread, bearing.bricks().at(x, y, z) - kIsoNearSteps);
          if (field.free.at(x, y, z) != free) REQUIRE(field.free.at(x, y, z) == free);
          soft_alone += free > unread ? 1 : 0;
        }
      }
    }
  }
  CHECK(soft_alone > 0);
}

TEST_CASE("a sphere needs the steps of its radius, and more than there are where it is too large") {
  CHECK(free_steps_for(0.5) == 2);
  CHECK(free_steps_for(0.51) == 3);
  CHECK(free_steps_for(3.5) == 14);
  CHECK(free_steps_for(63.5) == 254);
  CHECK(free_steps_for(63.6) == 255);
  CHECK(free_steps_for(1000) == 255);
}
