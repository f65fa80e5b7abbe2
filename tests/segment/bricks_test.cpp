// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <set>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "shared/volume/changed_bricks.hpp"

namespace kerf::bricks_test {

TEST_CASE("bricks tile every volume: each voxel lies in exactly one") {
  for (const std::int32_t n : {1, 7, 8, 9, 161}) {
    CAPTURE(n);
    const BrickGrid bricks = BrickGrid::of({n, 9, 8});
    std::size_t voxels = 0;
    for (std::uint32_t id = 0; id < bricks.count(); ++id) {
      CHECK(bricks.id(bricks.brick(id)) == id);
      const VoxelIndex extent = bricks.voxels(id).extent();
      CHECK(extent.x >= 1);
      CHECK(extent.x <= kBrickEdge);
      voxels += static_cast<std::size_t>(extent.x * extent.y * extent.z);
    }
    CHECK(voxels == bricks.grid.voxel_count());
  }
}

TEST_CASE("the bricks of a box are those that share a voxel with it") {
  CHECK(rc::check([] {
    const auto edge = [] { return *rc::gen::inRange(1, 40); };
    const BrickGrid bricks = BrickGrid::of({edge(), edge(), edge()});
    const auto at = [] { return *rc::gen::inRange(-5, 45); };
    const VoxelBox box{{at(), at(), at()}, {at(), at(), at()}};
    const VoxelBox touched = bricks.bricks_of(box);
    for (std::uint32_t id = 0; id < bricks.count(); ++id) {
      const VoxelIndex b = bricks.brick(id);
      const bool listed = !touched.empty() && b.x >= touched.lo.x && b.x < touched.hi.x &&
                          b.y >= touched.lo.y && b.y < touched.hi.y && b.z >= touched.lo.z &&
                          b.z < touched.hi.z;
      RC_ASSERT(listed == !bricks.voxels(id).clipped(box).empty());
    }
  }));
}

TEST_CASE("marked bricks are taken once each, within the budget, whatever the order of calls") {
  CHECK(rc::check([] {
    const auto edge = [] { return *rc::gen::inRange(1, 80); };
    const BrickGrid bricks = BrickGrid::of({edge(), edge(), edge()});
    BrickSet dirty(bricks);
    std::set<std::uint32_t> expected;
    const int steps = *rc::gen::inRange(1, 20);
    for (int step = 0; step < steps; ++step) {
      const auto at = [] { return *rc::gen::inRange(0, 80); };
      const VoxelBox voxels{{at(), at(), at()}, {at(), at(), at()}};
      dirty.mark(voxels);
      const VoxelBox box = bricks.bricks_of(voxels);
      for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
        for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
          for (std::int32_t x = box.lo.x; x < box.hi.x; ++x) expected.insert(bricks.id({x, y, z}));
        }
      }
      RC_ASSERT(dirty.waiting() == expected.size());
      const auto budget = *rc::gen::inRange<std::uint32_t>(0, 50);
      const std::uint32_t taken = dirty.take(
          budget, [&](std::uint32_t id, const VoxelBox&) { RC_ASSERT(expected.erase(id) == 1); });
      RC_ASSERT(taken <= budget);
      RC_ASSERT(taken == budget || expected.empty());
    }
    while (dirty.waiting() != 0) {
      dirty.take(7, [&](std::uint32_t id, const VoxelBox&) { RC_ASSERT(expected.erase(id) == 1); });
    }
    RC_ASSERT(expected.empty());
  }));
}

TEST_CASE("no brick starves while others change in every tick") {
  const BrickGrid bricks = BrickGrid::of({8 * 256, 8, 8});
  BrickSet dirty(bricks);
  dirty.mark({{8 * 255, 0, 0}, {8 * 256, 8, 8}});
  bool reached = false;
  for (int tick = 0; tick < 4 && !reached; ++tick) {
    dirty.mark({{0, 0, 0}, {8 * 255, 8, 8}});
    dirty.take(64, [&](std::uint32_t id, const VoxelBox&) { reached |= id == 255; });
  }
  CHECK(reached);
}

TEST_CASE("changed bricks hold exactly the voxels that differ, in boxes within a cell of 2^3") {
  CHECK(rc::check([] {
    const auto edge = [] { return *rc::gen::inRange(1, 20); };
    const VoxelGrid grid{edge(), edge(), edge()};
    const BrickGrid bricks = BrickGrid::of(grid);
    std::vector<Density> first(grid.voxel_count()), now;
    ChangedBricks all;
    std::set<std::size_t> differ;
    VoxelBox around;
    for (int step = 0; step < 3; ++step) {  // merged into one
      now = first;
      const auto voxels =
          *rc::gen::container<std::set<std::size_t>>(rc::gen::inRange<std::size_t>(0, now.size()));
      for (const std::size_t i : voxels) ++now[i];
      differ.insert(voxels.begin(), voxels.end());
      all.add(changed_between(bricks, first, now));
    }
    std::size_t in_masks = 0, outside = differ.size();
    for (const ChangedBrick& brick : all) {
      for (const std::uint64_t layer : brick.voxels) {
        in_masks += static_cast<std::size_t>(std::popcount(layer));
      }
    }
    all.for_each_box(bricks, [&](const VoxelBox& box) {
      around = around.united(box);
      RC_ASSERT(box.lo.x / 2 == (box.hi.x - 1) / 2);
      RC_ASSERT(box.lo.y / 2 == (box.hi.y - 1) / 2);
      RC_ASSERT(box.lo.z / 2 == (box.hi.z - 1) / 2);
      for_each_voxel(box,
                     [&](int x, int y, int z) { outside -= differ.count(grid.index(x, y, z)); });
      VoxelBox smallest;
      for_each_voxel(box, [&](int x, int y, int z) {
        if (differ.count(grid.index(x, y, z)) != 0) smallest = smallest.with({x, y, z});
      });
      RC_ASSERT(smallest == box);
    });
    RC_ASSERT(in_masks == differ.size());
    RC_ASSERT(outside == 0U);
    RC_ASSERT(all.bounds(bricks) == around);
    RC_ASSERT(std::is_sorted(all.begin(), all.end(),
                             [](const auto& a, const auto& b) { return a.id < b.id; }));
  }));
}

}  // namespace kerf::bricks_test
