// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "tests/visualizer/gl/gl_fixture.hpp"
#include "visualizer/render/macrocell_faces.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

using Faces = std::vector<CellFaces::Face>;

Faces sorted(std::span<const CellFaces::Face> faces) {
  Faces all(faces.begin(), faces.end());
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace

TEST_CASE(
    "faces that follow flipped cells, and a copy that takes the runs, equal faces made anew") {
  CHECK(rc::check([] {
    constexpr VoxelGrid kGrid{40, 27, 33};
    constexpr Density kIso = 30'000;
    const BrickGrid bricks = BrickGrid::of(kGrid);
    std::vector<Density> density(kGrid.voxel_count());
    const auto fill = [&](std::uint32_t id, Density value) {
      const VoxelBox box = bricks.voxels(id);
      for (int z = box.lo.z; z < box.hi.z; ++z) {
        for (int y = box.lo.y; y < box.hi.y; ++y) {
          for (int x = box.lo.x; x < box.hi.x; ++x) density[kGrid.index(x, y, z)] = value;
        }
      }
    };
    const auto any_brick = rc::gen::inRange(0U, bricks.count());
    for (int i = 0; i < 30; ++i) fill(*any_brick, kIso);
    Macrocells cells(kGrid, density, kIso);
    CellFaces faces(cells);
    Faces copy(faces.all().begin(), faces.all().end());
    for (int i = 0; i < 8; ++i) {
      const std::uint32_t id = *any_brick;
      fill(id, *rc::gen::element(Density{0}, kIso));
      const VoxelBox flipped =
          cells.update_bricks(bricks, changed_in(bricks, bricks.voxels(id)), density);
      if (flipped.empty()) continue;
      const auto runs = faces.update(cells, flipped);
      copy.resize(faces.all().size());
      for (const auto& [first, end] : runs) {
        RC_ASSERT(first < end);
        RC_ASSERT(end <= copy.size());
        std::copy(faces.all().begin() + static_cast<std::ptrdiff_t>(first),
                  faces.all().begin() + static_cast<std::ptrdiff_t>(end),
                  copy.begin() + static_cast<std::ptrdiff_t>(first));
      }
      RC_ASSERT(std::ranges::equal(copy, faces.all()));
      RC_ASSERT(sorted(faces.all()) == sorted(cells.boundary_faces()));
    }
  }));
}

TEST_CASE("a list is given room for all faces of a volume a few voxels thick") {
  for (const VoxelGrid& grid : {VoxelGrid{7, 7, 95}, VoxelGrid{7, 15, 31}, VoxelGrid{95, 1, 1}}) {
    const std::vector<Density> solid(grid.voxel_count(), 60'000);
    const Macrocells cells(grid, solid, 1);
    CHECK(CellFaces(cells).all().size() <= CellFaces::most(cells.grid()));
  }
}

TEST_CASE("a list is given room for all faces of cells that take turns") {
  constexpr VoxelGrid kGrid{39, 31, 23};  // 5 x 4 x 3 cells
  std::vector<Density> density(kGrid.voxel_count());
  for (int z = 0; z < kGrid.nz; ++z) {
    for (int y = 0; y < kGrid.ny; ++y) {
      for (int x = 0; x < kGrid.nx; ++x) {
        // The middle of a cell: what lies on its border belongs to its neighbour too.
        const bool inner = (x + 1) % 8 == 4 && (y + 1) % 8 == 4 && (z + 1) % 8 == 4;
        const bool turn = ((x + 1) / 8 + (y + 1) / 8 + (z + 1) / 8) % 2 == 0;
        if (inner && turn) density[kGrid.index(x, y, z)] = 60'000;
      }
    }
  }
  const CellFaces faces(Macrocells(kGrid, density, 1));
  CHECK(faces.all().size() == 6 * 30);
  CHECK(faces.all().size() <= CellFaces::most({5, 4, 3}));
  CHECK(faces.active_box() == VoxelBox{{0, 0, 0}, {5, 4, 3}});
}
