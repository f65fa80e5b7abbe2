// SPDX-License-Identifier: Apache-2.0
#include "visualizer/cast/macrocells.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "shared/volume/brick_grid.hpp"
#include "tests/visualizer/gl/gl_fixture.hpp"
#include "visualizer/render/macrocell_faces.hpp"

namespace kerf::macrocells_test {

using namespace kerf::test;

namespace {

std::vector<Density> random_density(const VoxelGrid& grid) {
  const auto values =
      *rc::gen::container<std::vector<Density>>(97, rc::gen::inRange<Density>(0, 65535));
  std::vector<Density> density(grid.voxel_count());
  for (std::size_t i = 0; i < density.size(); ++i) density[i] = values[i * 31 % values.size()];
  return density;
}

VoxelGrid random_grid() {
  const auto edge = rc::gen::inRange(1, 20);
  return {*edge, *edge, *edge};
}

/// Trilinear, with air outside, as the texture unit samples.
double sample(const VoxelGrid& grid, const std::vector<Density>& density,
              std::array<double, 3> at) {
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    VoxelIndex v;
    double weight = 1.0;
    const auto along = [&](double x, int bit) {
      const double low = std::floor(x);
      weight *= bit != 0 ? x - low : 1.0 - (x - low);
      return static_cast<std::int32_t>(low) + bit;
    };
    v.x = along(at[0], corner & 1);
    v.y = along(at[1], corner >> 1 & 1);
    v.z = along(at[2], corner >> 2);
    if (grid.contains(v)) sum += weight * density[grid.index(v.x, v.y, v.z)];
  }
  return sum;
}

}  // namespace

TEST_CASE("a sample that reaches iso lies in an active octant, in and around the volume") {
  CHECK(rc::check([] {
    const VoxelGrid grid = random_grid();
    const auto density = random_density(grid);
    const std::int32_t edge = *rc::gen::element(2, 4, 8);
    const Density iso = *rc::gen::inRange<Density>(1, 65535);
    const Macrocells cells(grid, density, iso, edge);
    const auto unit = rc::gen::inRange(0, 1000);  // a sample at the far end itself is air
    const auto coordinate = [&](int n) { return -1.0 + *unit * 1e-3 * (n + 1); };
    const std::array<double, 3> at{coordinate(grid.nx), coordinate(grid.ny), coordinate(grid.nz)};
    const auto cell = [&](double v) { return static_cast<std::int32_t>((v + 1.0) / edge); };
    const VoxelIndex index{cell(at[0]), cell(at[1]), cell(at[2])};
    RC_ASSERT(cells.grid().contains(index));
    const auto half = [&](double v) { return static_cast<unsigned>((v + 1.0) * 2.0 / edge) & 1U; };
    const unsigned octant = half(at[0]) + 2 * half(at[1]) + 4 * half(at[2]);
    const unsigned octants = cells.active()[cells.grid().index(index.x, index.y, index.z)];
    RC_ASSERT((octants >> octant & 1U) != 0 || sample(grid, density, at) < iso);
  }));
}

TEST_CASE("an octant without a voxel of iso is none") {
  const VoxelGrid grid{9, 9, 9};
  std::vector<Density> density(grid.voxel_count());
  density[grid.index(3, 4, 5)] = 60'000;  // coordinates 4, 5, 6 from the border
  const Macrocells cells(grid, density, 60'000, 2);
  for_each_voxel(cells.grid().box(), [&](int x, int y, int z) {
    unsigned wanted = 0;
    for (int octant = 0; octant < 8; ++octant) {
      const VoxelIndex low{2 * x + (octant & 1), 2 * y + (octant >> 1 & 1), 2 * z + (octant >> 2)};
      const bool holds =
          (low.x == 3 || low.x == 4) && (low.y == 4 || low.y == 5) && (low.z == 5 || low.z == 6);
      wanted |= holds ? 1U << octant : 0U;
    }
    CHECK(unsigned{cells.active()[cells.grid().index(x, y, z)]} == wanted);
  });
}

TEST_CASE("cells kept up by changed bricks equal cells made anew") {
  CHECK(rc::check([] {
    const VoxelGrid grid = random_grid();
    const Density iso = *rc::gen::inRange<Density>(1, 65535);
    auto density = random_density(grid);
    const std::int32_t edge = *rc::gen::element(2, 4, 8);
    Macrocells kept(grid, density, iso, edge);
    const BrickGrid bricks = BrickGrid::of(grid);
    const auto id = *rc::gen::inRange(0U, bricks.count());
    const Density value = *rc::gen::arbitrary<Density>();
    const VoxelBox box = bricks.voxels(id);
    for_each_voxel(box, [&](int x, int y, int z) { density[grid.index(x, y, z)] = value; });
    const std::vector<std::uint8_t> before(kept.active().begin(), kept.active().end());
    const VoxelBox flipped =
        kept.update_bricks(bricks, changed_in(bricks, bricks.voxels(id)), density);
    const Macrocells made(grid, density, iso, edge);
    RC_ASSERT(std::ranges::equal(kept.active(), made.active()));
    VoxelBox others;
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (kept.active()[i] == before[i]) continue;
      const VoxelGrid& n = kept.grid();
      const auto at = static_cast<int>(i);
      const VoxelIndex cell{at % n.nx, at / n.nx % n.ny, at / n.nx / n.ny};
      others = others.united({cell, {cell.x + 1, cell.y + 1, cell.z + 1}});
    }
    RC_ASSERT(flipped == others);
  }));
}

TEST_CASE("a line through the cells crosses as many faces inwards as outwards") {
  CHECK(rc::check([] {
    const VoxelGrid grid = random_grid();
    const auto density = random_density(grid);
    const Macrocells cells(grid, density, *rc::gen::inRange<Density>(60000, 65535));
    std::map<std::array<std::uint16_t, 3>, int>
        balance;  // of a line: axis and the other two places
    for (const auto& [x, y, z, face] : cells.boundary_faces()) {
      const auto axis = static_cast<std::uint16_t>(face / 2);
      const std::array<std::uint16_t, 3> place{x, y, z};
      balance[{axis, place[(axis + 1U) % 3], place[(axis + 2U) % 3]}] += face % 2 == 0 ? 1 : -1;
    }
    for (const auto& [line, sum] : balance) RC_ASSERT(sum == 0);
  }));
}

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
      for_each_voxel(box, [&](int x, int y, int z) { density[kGrid.index(x, y, z)] = value; });
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
  for_each_voxel(kGrid.box(), [&](int x, int y, int z) {
    // The middle of a cell: what lies on its border belongs to its neighbour too.
    const bool inner = (x + 1) % 8 == 4 && (y + 1) % 8 == 4 && (z + 1) % 8 == 4;
    const bool turn = ((x + 1) / 8 + (y + 1) / 8 + (z + 1) / 8) % 2 == 0;
    if (inner && turn) density[kGrid.index(x, y, z)] = 60'000;
  });
  const CellFaces faces(Macrocells(kGrid, density, 1));
  CHECK(faces.all().size() == 6 * 30);
  CHECK(faces.all().size() <= CellFaces::most({5, 4, 3}));
  CHECK(faces.active_box() == VoxelBox{{0, 0, 0}, {5, 4, 3}});
}

}  // namespace kerf::macrocells_test
