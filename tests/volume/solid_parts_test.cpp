// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <random>

#include <doctest/doctest.h>

#include "controller/volume/connected_parts.hpp"
#include "tests/volume/volume_files.hpp"

using namespace kerf;

namespace {

/// Sizes of the parts by walking from voxel to voxel: the obvious way.
std::vector<std::uint64_t> walked(const VoxelGrid& grid, std::vector<Density> density) {
  std::vector<std::uint64_t> sizes;
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = 0; y < grid.ny; ++y) {
      for (std::int32_t x = 0; x < grid.nx; ++x) {
        std::vector<VoxelIndex> open{{x, y, z}};
        std::uint64_t size = 0;
        while (!open.empty()) {
          const VoxelIndex v = open.back();
          open.pop_back();
          if (!grid.contains(v) || density[grid.index(v.x, v.y, v.z)] == 0) continue;
          density[grid.index(v.x, v.y, v.z)] = 0;
          ++size;
          for (const VoxelIndex& d :
               {VoxelIndex{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}) {
            open.push_back({v.x + d.x, v.y + d.y, v.z + d.z});
          }
        }
        if (size > 0) sizes.push_back(size);
      }
    }
  }
  std::ranges::sort(sizes, std::greater<>());
  return sizes;
}

}  // namespace

TEST_CASE("parts by runs are those of a walk from voxel to voxel") {
  std::mt19937 random(7);
  for (const int percent : {1, 20, 31, 50, 90, 100}) {
    const VoxelGrid grid{17, 9, 11};
    std::vector<Density> density(grid.voxel_count());
    for (Density& d : density) d = random() % 100 < static_cast<unsigned>(percent) ? 1 : 0;
    const SolidParts parts(grid, density, 1);
    std::vector<std::uint64_t> sizes;
    for (const SolidPart& part : parts.parts()) sizes.push_back(part.voxels);
    CAPTURE(percent);
    CHECK(sizes == walked(grid, density));
    std::uint64_t in_runs = 0;
    for (const SolidRun& run : parts.runs()) {
      in_runs += static_cast<std::uint64_t>(run.x1 - run.x0);
      const VoxelBox& box = parts.parts()[run.part].box;
      CHECK(box.contains({run.x0, run.y, run.z}));
      CHECK(box.contains({run.x1 - 1, run.y, run.z}));
    }
    CHECK(in_runs == static_cast<std::uint64_t>(std::ranges::count(density, 1)));
  }
  CHECK(SolidParts({4, 4, 4}, std::vector<Density>(64), 1).parts().empty());
}

TEST_CASE("a body's mask holds the body and not the couch that touches it") {
  VolumeImage image = test::air({96, 96, 96});
  const auto fill = [&](std::int32_t x, std::int32_t y, std::int32_t z) {
    image.density[image.grid.index(x, y, z)] = 1000;
  };
  for (std::int32_t z = 0; z < 96; ++z) {
    for (std::int32_t y = 0; y < 96; ++y) {
      for (std::int32_t x = 0; x < 96; ++x) {
        const bool body = (x - 48) * (x - 48) + (y - 40) * (y - 40) <= 30 * 30;
        const bool couch = y >= 70 && y < 72;
        if (body || couch) fill(x, y, z);
      }
    }
  }
  const BodyMask mask(image, 500);
  CHECK(mask.contains(48, 40, 48));
  CHECK(mask.contains(48, 10, 0));  // its skin
  CHECK(mask.contains(18, 40, 95));
  CHECK_FALSE(mask.contains(5, 70, 48));
  CHECK_FALSE(mask.contains(90, 71, 48));
}
