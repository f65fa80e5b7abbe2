// SPDX-License-Identifier: Apache-2.0
// What a scene is said to cost, against counts of what is really done and really there.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <set>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/kernel/contact.hpp"
#include "controller/kernel/overlap.hpp"
#include "controller/kernel/splat.hpp"
#include "controller/scene/aligned_tool.hpp"
#include "controller/scene/plan_cost.hpp"
#include "controller/scene/sample_tool.hpp"
#include "controller/scene/stage_timing.hpp"
#include "controller/scene/tick_memory.hpp"
#include "controller/scene/tool_shapes.hpp"
#include "controller/scene/work_budget.hpp"
#include "tests/servo/support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

std::uint64_t operations(const PlanCost& cost, const std::string& stage) {
  for (const StageCost& s : cost.stages) {
    if (s.stage == stage) return s.operations;
  }
  return 0;
}

SceneTool shape(const char* name, double radius_mm, double length_mm) {
  return make_tool(name, name,
                   {.pitch_mm = kVoxelMm, .radius_mm = radius_mm, .length_mm = length_mm});
}

/// A sum that counts the products which it was made of.
struct Counted {
  static inline std::uint64_t products = 0;
  Counted() = default;
  explicit Counted(double) {}
  friend Counted operator*(Counted, Counted) {
    ++products;
    return {};
  }
  Counted& operator+=(Counted) { return *this; }
};
struct CountingNumbers : DoubleNumbers {
  using Sum = Counted;
};

/// All voxels full: every stage does all that it ever does.
SceneVolume full_block(int edge) {
  return volume_of(edge, kVoxelMm, [](double, double, double) { return -1.0; });
}

/// A random turn, from a random quaternion.
Matrix random_turn() {
  std::array<double, 4> q{};
  double length = 0;
  for (double& part : q) {
    part = std::rand() / (RAND_MAX / 2.0) - 1;
    length += part * part;
  }
  for (double& part : q) part /= std::sqrt(length);
  return matrix_of(q);
}

std::set<std::string> names(const std::vector<ArrayBytes>& arrays) {
  std::set<std::string> set;
  for (const ArrayBytes& array : arrays) {
    CHECK(array.bytes > 0);
    set.insert(array.name);
  }
  return set;
}

}  // namespace

TEST_CASE("the voxels that a tick copies are those that are written") {
  const std::vector<Density> air(std::size_t{64} * 64 * 64, 7);
  for (const int size : {3, 10, 16}) {
    const SceneTool tool = ball(size);
    const AlignedTool aligned(tool.offsets, kExactFarid, kScalarSet);
    BoxMemory memory;
    memory.hold(aligned.table().size, false);
    const BoxScratch scratch = memory.view();
    const std::size_t room = box_scratch_size(aligned.table().size).box;
    std::fill_n(scratch.box, room, std::int16_t{1});
    kScalarSet.copy_box(aligned.table(), {64, 64, 64}, air.data(), {20, 20, 20}, scratch);
    const auto written = std::count(scratch.box, scratch.box + room, std::int16_t(7 - 32768));
    CHECK(operations(aligned_cost(aligned.table(), kScalarSet, false), "copy") ==
          static_cast<std::uint64_t>(written));
  }
}

TEST_CASE("the multiply-adds of a correlation are those of its chunks, and cover the table") {
  for (auto set = kernel_sets(); *set != nullptr; ++set) {
    for (const int size : {3, 10, 16, 40}) {
      const SceneTool tool = ball(size);
      const AlignedTool aligned(tool.offsets, kExactFarid, **set);
      const AlignedTable& table = aligned.table();
      std::uint64_t visited = 0, filled = 0;  // table entries, as the kernel walks over them
      for (std::size_t list = 0; list < 3; ++list) {
        for (std::int32_t i = 0; i < table.chunk_count[list]; ++i) {
          const std::int16_t* run = table.vectors + table.chunks[list][i].vector;
          const std::int32_t entries = (table.fused ? 6 : 2) * table.lanes;
          for (std::int32_t entry = 0; entry < entries; ++entry, ++visited) {
            if (run[entry] != 0) ++filled;
          }
        }
      }
      const PlanCost cost = aligned_cost(table, **set, true);
      CHECK(operations(cost, "contact") == 8 * visited);
      CHECK(filled > visited / 4);  // the lists leave the zeros out, else the count were idle

      std::uint64_t mill = 0;  // the loops of the kernel, one count an entry and operation
      for (std::int32_t z = 0; z <= table.size.z; ++z) {
        for (std::int32_t y = 0; y <= table.size.y + 4; ++y) {
          for (std::int32_t x = 0; x < table.row_lanes; ++x) {
            mill += 5 + 5;                          // along z: smooth and slope
            if (y > table.size.y) continue;         // rows of ratios
            mill += 8 + (5 + 5) + (5 + 5 + 5) + 3;  // masks, x, y, products
            mill += 1;                              // removal
          }
        }
      }
      CHECK(operations(cost, "mill") == mill);
      CHECK(operations(aligned_cost(table, **set, false), "mill") == 0);
    }
  }
}

TEST_CASE("the corners that a contact visits are the products of its sum") {
  const SceneVolume block = full_block(64);
  const std::vector<Gradient<CountingNumbers>> field(block.image.density.size());
  for (const SceneTool& tool : {shape("cone", 0.6, 2), shape("wheel", 1, 0.5)}) {
    ToolPose<CountingNumbers> pose;
    pose.centre_vox = {32.3, 31.8, 30.5};
    for (std::size_t i = 0; i < 3; ++i) pose.step[i][i] = 1;
    Counted::products = 0;
    static_cast<void>(contact_sum<CountingNumbers>(
        block.image.grid, std::span<const Gradient<CountingNumbers>>(field), tool.offsets, pose));
    CHECK(3 * operations(gather_cost(NumericKind::fixed, kScalarSet, tool, block, false),
                         "contact") ==
          Counted::products);
  }
}

TEST_CASE("a splatting tick copies no more voxels than it is said to, in any pose") {
  SceneVolume block = full_block(64);
  std::srand(4);
  for (const SceneTool& tool : {shape("cylinder", 0.5, 4), shape("wheel", 1, 0.5)}) {
    const SampleTool samples(tool.offsets, SampleOrder::scattered);
    SplatMemory memory;
    const std::size_t width = overlap_width(tool.size_vox, kVoxelMm, kVoxelMm);
    memory.hold({width, width, width}, tool.offsets.size());
    const SplatScratch scratch = memory.view();
    const PlanCost cost = splat_cost(kScalarSet, tool, block);
    CHECK(operations(cost, "place") == 9 * tool.offsets.size());
    CHECK(operations(cost, "splat") == 8 * tool.offsets.size());
    std::int64_t most = 0;
    for (int i = 0; i < 2000; ++i) {
      ToolPose<FixedNumbers> pose;
      pose.centre_vox = {Q16(32 + i % 7 * 0.13), Q16(31 + i % 11 * 0.09), Q16(32.0)};
      const Matrix turn = random_turn();
      for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < 3; ++b) pose.step[a][b] = step_of<FixedNumbers>(turn[a][b]);
      }
      const SplatTick tick(kScalarSet, samples.table(), kExactFarid, scratch, block.image.grid,
                           block.image.density, pose);
      const VoxelIndex box = tick.box().box;
      most = std::max(most, std::int64_t{box.x} * box.y * box.z);
    }
    CHECK(most <= static_cast<std::int64_t>(operations(cost, "copy")));
    CHECK(static_cast<double>(most) > 0.7 * static_cast<double>(operations(cost, "copy")));
  }
}

TEST_CASE("no orientation covers more voxels than the bound, and some nearly as many") {
  const SceneVolume block = full_block(64);
  std::srand(3);
  for (const SceneTool& tool : {shape("cylinder", 0.5, 4), shape("wheel", 1.5, 0.8),
                                shape("flame", 0.6, 3), shape("cylinder", 1, 2)}) {
    const std::uint64_t bound = covered_voxels(tool, block, 3);
    std::vector<double> memory(std::size_t{50} * 50 * 50);
    std::uint64_t most = 0;
    for (int i = 0; i < 3000; ++i) {
      ToolPose<DoubleNumbers> pose;
      pose.centre_vox = {32 + i % 7 * 0.13, 31 + i % 11 * 0.09, 32};
      pose.step = random_turn();
      OverlapBox<DoubleNumbers> box{memory, {}, 0};
      const VoxelIndex size =
          overlap<DoubleNumbers>(block.image.grid, tool.offsets, pose, 1, box).extent();
      most =
          std::max(most, static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y) *
                             static_cast<std::uint64_t>(size.z));
    }
    CAPTURE(tool.name);
    CHECK(most <= bound);
    if (tool.name != "flame") CHECK(double(most) > 0.7 * double(bound));  // fills no cylinder
    CHECK(covered_voxels(tool, full_block(8), 3) <= 512);
  }
}

TEST_CASE("every stage of every plan has a price, and every stage is timed") {
  for (const auto numeric : {NumericKind::fixed, NumericKind::float32, NumericKind::float64}) {
    Scene scene = half_space_scene(48);
    scene.tools.push_back(shape("cone", 0.6, 2));
    scene.cut.model = CutModel::overlap;
    scene.servo.numeric = numeric;
    const auto servo = compile(scene);
    const auto& ticks = servo->costs().ticks;
    REQUIRE(ticks.size() == 2);
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      CHECK(work_us(ticks[i].cost) > 0);
      const std::vector<double> us = servo->time_stages(i);
      REQUIRE(us.size() == ticks[i].cost.stages.size());
    }
  }
  const AlignedTool aligned(ball(10).offsets, kExactFarid, kScalarSet);
  for (auto set = kernel_sets(); *set != nullptr; ++set) {
    CHECK(work_us(aligned_cost(aligned.table(), **set, true)) > 0);
  }
}

TEST_CASE("a scene above the budget is refused on one line, and fits at a lower rate") {
  Scene scene = half_space_scene(48);
  scene.path = "scenes/x.toml";
  scene.cut.model = CutModel::overlap;
  scene.tools.push_back(shape("cylinder", 2, 4));
  scene.tools.back().name = "stub";
  scene.servo.rate_hz = 8000;
  const std::string line = over_budget(scene, plan_scene(scene)->costs());
  CHECK(line.find("scenes/x.toml: tool stub: up to ") == 0);
  CHECK(line.find("plan splat/") != std::string::npos);
  CHECK(line.find("; use a smaller tool, a lower rate") != std::string::npos);
  CHECK(line.find('\n') == std::string::npos);
  scene.tools.pop_back();
  CHECK(over_budget(scene, plan_scene(scene)->costs()).empty());
  scene.tools.push_back(shape("cylinder", 0.5, 1));
  scene.servo.rate_hz = 250;
  CHECK(over_budget(scene, plan_scene(scene)->costs()).empty());
}

TEST_CASE("a scene holds the arrays that it names, and no others") {
  using Names = std::set<std::string>;
  const auto arrays_of = [](Scene scene) { return names(compile(scene)->costs().arrays); };
  Scene touch = half_space_scene(32);
  CHECK(arrays_of(touch) ==
        Names{"density of test", "samples of ball", "table of ball", "box", "columns inside"});
  Scene cut = touch;
  cut.cut.model = CutModel::overlap;
  CHECK(arrays_of(cut) == Names{"density of test", "carry of test", "samples of ball",
                                "table of ball", "box", "columns inside", "overlap ratios",
                                "filtered rows", "live rows"});
  Scene odd = touch;
  odd.tools = {shape("cone", 0.6, 2)};
  CHECK(arrays_of(odd) ==
        Names{"density of test", "gradient of test", "samples of cone", "ordered samples of cone"});
  Scene odd_cut = odd;
  odd_cut.cut.model = CutModel::overlap;
  odd_cut.volumes[0].image.labels.assign(odd_cut.volumes[0].image.density.size(), 1);
  CHECK(arrays_of(odd_cut) ==
        Names{"density of test", "labels of test", "carry of test", "samples of cone",
              "ordered samples of cone", "box", "columns inside", "overlap ratios", "filtered rows",
              "live rows", "sample places", "overlap sums", "rest rows", "live rest rows"});
  Scene floating = odd_cut;
  floating.servo.numeric = NumericKind::float64;
  CHECK(arrays_of(floating) == Names{"density of test", "labels of test", "gradient of test",
                                     "carry of test", "samples of cone", "overlap box",
                                     "refresh planes"});
  odd_cut.tools[0].turns = false;
  const Names unturned = arrays_of(odd_cut);
  CHECK(unturned.count("ordered samples of cone") == 0);
  CHECK(unturned.count("table of cone") == 1);
}
