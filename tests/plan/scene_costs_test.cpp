// SPDX-License-Identifier: Apache-2.0
// What a scene is said to cost, against counts of what is really done and really there.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <doctest/doctest.h>

#include "controller/kernel/overlap.hpp"
#include "controller/kernel/overlap_methods.hpp"
#include "controller/plan/compile.hpp"
#include "controller/plan/method/tool_method.hpp"
#include "controller/plan/tables/sample_tables.hpp"
#include "controller/plan/worst_tick.hpp"
#include "controller/scene/scene_file.hpp"
#include "tests/plan/costs_support.hpp"
#include "tests/support/errors.hpp"

namespace kerf::scene_costs_test {

using namespace kerf::test;

namespace {

std::uint64_t operations(const std::vector<StageCost>& stages, const std::string& stage) {
  for (const StageCost& s : stages) {
    if (s.stage == stage) return s.operations;
  }
  return 0;
}

/// What a method counts of a tool with this table.
std::vector<StageCost> aligned_stages(const AlignedTable& table, const KernelSet& kernels,
                                      CutModel cut) {
  return aligned_method().stages({.cut = cut, .runs_it = kernels.name, .table = &table}, {});
}

/// What a method counts of a tool in a volume, in any pose.
std::vector<StageCost> any_pose_stages(const ToolMethod& method, std::string_view runs_it,
                                       const SceneTool& tool, const SceneVolume& volume,
                                       CutModel cut) {
  const LoadedScene scene;
  const TickShape shape{
      .samples = tool.offsets.size(), .grid = volume.image.grid, .cut = cut, .runs_it = runs_it};
  return most_stages(method, shape, {scene, tool, volume, kScalarSet}, 0);
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
    CHECK(operations(aligned_stages(aligned.table(), kScalarSet, CutModel::none), "copy") ==
          static_cast<std::uint64_t>(written));
  }
}

TEST_CASE("the multiply-adds of a correlation are those of its chunks, and cover the table") {
  for (const KernelSet& set : planned_sets()) {
    for (const int size : {3, 10, 16, 40}) {
      const SceneTool tool = ball(size);
      const AlignedTool aligned(tool.offsets, kExactFarid, set);
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
      const std::vector<StageCost> cost = aligned_stages(table, set, CutModel::overlap_exact);
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
      const auto edge = static_cast<std::uint64_t>(size) + 1;
      CHECK(operations(cost, "bend") == edge * edge * edge);
      CHECK(operations(aligned_stages(table, set, CutModel::overlap), "bend") == 0);
      CHECK(operations(aligned_stages(table, set, CutModel::none), "mill") == 0);
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
    CHECK(3 * operations(any_pose_stages(gather_method(), "scalar", tool, block, CutModel::none),
                         "contact") ==
          Counted::products);
  }
}

TEST_CASE("a splatting tick does no more than it is said to, in any pose and any volume") {
  std::srand(4);
  for (const int edge : {64, 8}) {  // wider than the tool, and narrower
    SceneVolume block = full_block(edge);
    for (const SceneTool& tool :
         {shape("cylinder", 0.5, 4), shape("wheel", 1, 0.5), shape("flame", 0.6, 3)}) {
      const SampleTool samples(tool.offsets, SampleOrder::scattered);
      SplatMemory memory;
      const std::size_t width = overlap_width(tool.size_vox, kVoxelMm, kVoxelMm);
      memory.hold({width, width, width}, tool.offsets.size());
      const SplatScratch scratch = memory.view();
      const std::vector<StageCost> cost =
          any_pose_stages(splat_method(), "scalar", tool, block, CutModel::overlap_exact);
      CHECK(operations(cost, "place") == 9 * tool.offsets.size());
      CHECK(operations(cost, "splat") == 8 * tool.offsets.size());
      const std::array loops{"copy", "press", "bend", "cut"};
      std::array<std::uint64_t, 4> most{};
      for (int i = 0; i < 2000; ++i) {
        const ToolPose<FixedNumbers> pose = rounded(turned_in_block(edge, i));
        const SplatTick tick(kScalarSet, samples.table(), kExactFarid, scratch, block.image.grid,
                             block.image.density, pose);
        const TickBox& box = tick.box();
        const auto product = [](std::int32_t x, std::int32_t y, std::int32_t z) {
          return static_cast<std::uint64_t>(x) * static_cast<std::uint64_t>(y) *
                 static_cast<std::uint64_t>(z);
        };
        const std::int32_t x = box.size.x + 1, y = box.size.y + 1, z = box.size.z + 1;
        const std::array done{product(box.box.x, box.box.y, box.box.z),
                              8 * product(box.row_lanes, y, z), product(x, y, z),
                              product(box.row_lanes, y, z)};
        for (std::size_t k = 0; k < done.size(); ++k) most[k] = std::max(most[k], done[k]);
      }
      CAPTURE(tool.name);
      for (std::size_t k = 0; k < most.size(); ++k) {
        CAPTURE(loops[k]);
        CHECK(most[k] <= operations(cost, loops[k]));
        CHECK(static_cast<double>(most[k]) > 0.7 * static_cast<double>(operations(cost, loops[k])));
      }
    }
  }
}

TEST_CASE("a gathering tick that cuts works on no more voxels than it is said to") {
  const auto voxels = [](const VoxelBox& box) {
    const VoxelIndex size = box.extent();
    return VoxelGrid{size.x, size.y, size.z}.voxel_count();
  };
  std::srand(3);
  for (const int edge : {64, 8}) {
    const SceneVolume block = full_block(edge);
    for (const SceneTool& tool : {shape("cylinder", 0.5, 4), shape("wheel", 1.5, 0.8),
                                  shape("flame", 0.6, 3), shape("cylinder", 1, 2)}) {
      const std::vector<StageCost> cost =
          any_pose_stages(gather_method(), "double", tool, block, CutModel::overlap);
      // A sample's place twice, its weights and their sums; the rest of `overlap` are voxels.
      const std::uint64_t spread = (2 * 9 + 2 * 8) * tool.offsets.size();
      std::vector<double> memory(std::size_t{50} * 50 * 50);
      std::uint64_t overlapped = 0, cut = 0, refreshed = 0;
      for (int i = 0; i < 3000; ++i) {
        const ToolPose<DoubleNumbers> pose = turned_in_block(edge, i);
        OverlapBox<DoubleNumbers> box{memory, {}, 0};
        const VoxelBox inside =
            overlap<DoubleNumbers>(block.image.grid, tool.offsets, pose, 1, box);
        overlapped = std::max(overlapped, voxels(box.box));
        cut = std::max(cut, voxels(inside));
        refreshed = std::max(refreshed,
                             voxels(inside.grown(kGradientReach).clipped(block.image.grid.box())));
      }
      CAPTURE(tool.name);
      CAPTURE(edge);
      CHECK(spread + overlapped <= operations(cost, "overlap"));
      CHECK(cut <= operations(cost, "modification"));
      CHECK(cut <= operations(cost, "removal"));
      CHECK(refreshed <= operations(cost, "refresh"));
      CHECK(double(cut) > 0.7 * double(operations(cost, "removal")));
    }
  }
}

TEST_CASE("a scene is planned with what the servo allows the queries of a tick") {
  PointTable<FixedNumbers> points;
  points.count = 500;
  points.groups = 32;
  points.round = true;
  CHECK(query_work(points, 2).query == 2 * (512 + 128));
  CHECK(query_work(points, 2).closer == 2 * (128 + 128));
  CHECK(query_work(points, 2).orient == 2 * 62);
  points.round = false;
  CHECK(query_work(points, 1).query == 512 + 128);
  CHECK(query_work(points, 1).closer == (128 + 2 * 448) + 2 * (128 + 32));
  const auto most = [](std::int64_t query, std::int64_t closer, std::int64_t orient) {
    return QueryWork{query, closer, orient}.most();
  };
  CHECK(most(300, 100, 50) == 32 * 400 + 13 * 50);
  CHECK(most(900, 100, 90) == 15000);
  CHECK(most(2000, 200, 200) == 12 * 2200);
  CHECK(most(900, 3200, 90) == 15000 + 990);

  LoadedScene scene = half_space_scene(48);
  scene.tools = {shape("wheel", 2, 1)};
  const auto queries_of = [&] {
    return operations(plan_scene(scene)->costs().ticks.front().stages, "queries");
  };
  const std::uint64_t alone = queries_of();
  scene.volumes.push_back(scene.volumes.front());
  scene.volumes.back().name = "other";
  CHECK(2 * queries_of() >= alone);  // of both together
  CHECK(queries_of() <= alone);
}

TEST_CASE("every stage of every method has a price, on machines of all kinds") {
  const SceneVolume block = full_block(32);
  const SceneTool cone = shape("cone", 0.6, 2);
  for (const KernelSet& set : planned_sets()) {
    CAPTURE(std::string(set.name));
    const AlignedTool aligned(ball(10).offsets, kExactFarid, set);
    for (const CutModel cut :
         {CutModel::none, CutModel::overlap, CutModel::overlap_exact, CutModel::preston}) {
      CHECK(work_us(aligned_stages(aligned.table(), set, cut)) > 0);
      const auto work = [&](const ToolMethod& method, const char* runs_it) {
        return work_us(any_pose_stages(method, runs_it, cone, block, cut));
      };
      CHECK(work(splat_method(), set.name) > 0);
      if (cut == CutModel::none) CHECK(work(gather_method(), set.name) > 0);  // fixed point
      CHECK(work(gather_method(), "double") > 0);
    }
    CHECK(work_us(query_stage(1, set.name)) > 0);
  }
  CHECK(work_us(query_stage(1, "double")) > 0);
  CHECK_THROWS_AS(static_cast<void>(query_stage(1, "abacus")), std::logic_error);
}

TEST_CASE("the servo's own tick is timed, and does there no more than it is said to") {
  for (const auto numeric : {NumericKind::fixed, NumericKind::float64}) {
    for (const auto force : {ForceModel::paper, ForceModel::proxy}) {
      for (const auto cut :
           {CutModel::none, CutModel::overlap, CutModel::overlap_exact, CutModel::preston}) {
        if (cut == CutModel::preston && force == ForceModel::paper) continue;
        LoadedScene scene = half_space_scene(48);
        scene.force.model = force;
        scene.tools.push_back(shape("cone", 0.6, 2));
        scene.cut.model = cut;
        scene.cut.rate_per_s = 0;  // timed all the same
        scene.servo.numeric = numeric;
        const auto servo = compile(scene);
        const auto& ticks = servo->costs().ticks;
        REQUIRE(ticks.size() == 2);
        for (std::size_t i = 0; i < ticks.size(); ++i) {
          CAPTURE(ticks[i].variant());
          const std::vector<StageCost>& most = ticks[i].stages;
          const TickTime timed = servo->time_tick(i);
          CHECK(timed.median_us > 0);
          CHECK(timed.p99_us >= timed.median_us);
          REQUIRE(timed.stages.size() == most.size());
          for (std::size_t s = 0; s < most.size(); ++s) {
            CAPTURE(most[s].stage);
            CHECK(std::string(timed.stages[s].stage) == most[s].stage);
            CHECK(timed.stages[s].operations > 0);
            CHECK(timed.stages[s].operations <= most[s].operations);
          }
          // The drive is no idle one: it finds its way to where queries cost most.
          if (force == ForceModel::proxy)
            CHECK(2 * timed.stages[0].operations > most[0].operations);
        }
      }
    }
  }
}

TEST_CASE("a tool is timed where it has most density around it, wherever its centre is") {
  // Only the lower half along y is full, and the tool lies wholly above its centre.
  const SceneVolume half = volume_of(64, kVoxelMm, [](double, double y, double) { return y; });
  const VoxelIndex at =
      densest_position(half.image.grid, half.image.density, {{-3, 4, -3}, {4, 20, 4}});
  const auto full = [&](std::int32_t y) {
    return half.image.grid.contains({at.x, y, at.z}) &&
           half.image.density[half.image.grid.index(at.x, y, at.z)] != 0;
  };
  CHECK(full(at.y + 5));
  CHECK(full(at.y + 18));
}

TEST_CASE("a scene above the budget is refused on one line, and fits at a lower rate") {
  LoadedScene scene = paper_scene(48);
  scene.path = "scenes/x.toml";
  scene.cut.model = CutModel::overlap;
  scene.tools = {ball(4), shape("cylinder", 1.7, 3.4)};  // one fits, one does not, by each set
  scene.tools.back().name = "stub";
  scene.servo.rate_hz = 8000;
  const std::string line = budget_error(scene, plan_scene(scene)->costs());
  CHECK(line.find("scenes/x.toml: tool stub: up to ") == 0);
  CHECK(has(line, " by the method splat/"));
  CHECK(line.find(" us of work a tick, most of it press (") != std::string::npos);
  const double stub_us = work_us(plan_scene(scene)->costs(), 1);
  const int highest_hz = highest_rate_hz(stub_us);
  CHECK(has(line, ", above the 62.5 us that are half a tick at 8000 Hz; use --rate " +
                      std::to_string(highest_hz) +
                      " or lower, a smaller tool, or a round or unturned tool on the volume's "
                      "lattice"));
  CHECK(line.find('\n') == std::string::npos);
  scene.servo.rate_hz = highest_hz;
  CHECK(budget_error(scene, plan_scene(scene)->costs()).empty());
  scene.servo.rate_hz = highest_hz + 1;
  CHECK_FALSE(budget_error(scene, plan_scene(scene)->costs()).empty());
  // Of several the costliest decides, wherever it stands; the others are named.
  scene.servo.rate_hz = 8000;
  scene.tools.push_back(shape("cylinder", 2.5, 5));
  scene.tools.back().name = "stump";
  const std::string two = budget_error(scene, plan_scene(scene)->costs());
  CHECK(two.find("scenes/x.toml: tool stump: ") == 0);
  CHECK(has(two, " a smaller tool (too dear as well: stub), or a round"));
  scene.tools.pop_back();
  scene.tools.pop_back();
  CHECK(budget_error(scene, plan_scene(scene)->costs()).empty());
  // What fits one volume need not fit two: the refusal names both.
  scene.tools.push_back(shape("cylinder", 0.5, 2));
  const double alone_us = work_us(plan_scene(scene)->costs(), 1);
  scene.servo.rate_hz = static_cast<int>(1e6 * kBudgetRatio / (1.5 * alone_us));
  CHECK(budget_error(scene, plan_scene(scene)->costs()).empty());
  scene.volumes.push_back(scene.volumes.front());
  scene.volumes.back().name = "other";
  const SceneCosts both = plan_scene(scene)->costs();
  const std::string why = budget_error(scene, both);
  CHECK(has(why, " in test "));
  CHECK(has(why, ", in other "));
  CHECK(work_us(both, 1) == doctest::Approx(2 * alone_us));
  scene.volumes.pop_back();
  scene.tools.pop_back();
  scene.tools.push_back(shape("cylinder", 0.5, 1));
  scene.servo.rate_hz = 250;
  CHECK(budget_error(scene, plan_scene(scene)->costs()).empty());
}

TEST_CASE(
    "where queries cost most no other method is advised, and in floating point other numbers") {
  LoadedScene scene = half_space_scene(48);
  scene.path = "scenes/x.toml";
  scene.tools = {shape("wheel", 2, 1)};
  scene.servo.rate_hz = 8000;
  const auto refusal = [&] { return budget_error(scene, plan_scene(scene)->costs()); };
  CHECK(refusal().find(" most of it queries (") != std::string::npos);
  CHECK(refusal().ends_with(" or lower, or a smaller tool"));
  scene.servo.numeric = NumericKind::float64;
  CHECK(refusal().ends_with(" or lower, a smaller tool, or fixed numbers"));
  CHECK(highest_rate_hz(10) == kMaxRateHz);
  CHECK(highest_rate_hz(200) == 2500);
  CHECK(highest_rate_hz(2001) == 0);  // 249.9 Hz are not offered
}

TEST_CASE("the overlap box of two volumes has room for the larger one, and no more") {
  const auto bytes_of = [](std::initializer_list<int> edges) {
    LoadedScene scene = half_space_scene(32);
    scene.tools = {shape("cone", 1, 3)};
    scene.cut.model = CutModel::overlap;
    scene.servo.numeric = NumericKind::float64;
    scene.force.model = ForceModel::paper;
    scene.volumes.clear();
    for (const int edge : edges) {
      scene.volumes.push_back(full_block(edge));
      scene.volumes.back().name = "block " + std::to_string(edge);
    }
    const auto planned = plan_scene(scene);
    for (const ArrayBytes& array : planned->costs().arrays) {
      if (array.name == "overlap box") return array.bytes;
    }
    return std::uint64_t{0};
  };
  CHECK(bytes_of({4}) == 6 * 6 * 6 * sizeof(double));  // the volume and a voxel around it
  CHECK(bytes_of({4, 8}) == bytes_of({8}));
  CHECK(bytes_of({8, 4}) == bytes_of({8}));
  CHECK(bytes_of({64, 128}) == bytes_of({64}));  // wider than the tool
}

TEST_CASE("a scene holds the arrays that it names, and no others") {
  using Names = std::set<std::string>;
  const auto arrays_of = [](LoadedScene scene) { return names(compile(scene)->costs().arrays); };
  LoadedScene touch = paper_scene(32);
  CHECK(arrays_of(touch) ==
        Names{"density of test", "samples of ball", "table of ball", "box", "columns inside"});
  LoadedScene cut = touch;
  cut.cut.model = CutModel::overlap;
  CHECK(arrays_of(cut) == Names{"density of test", "carry of test", "first content of test",
                                "cut bricks of test", "bricks of the last strokes",
                                "whether they are kept", "samples of ball", "table of ball", "box",
                                "columns inside", "overlap ratios", "filtered rows", "live rows"});
  LoadedScene odd = touch;
  odd.tools = {shape("cone", 0.6, 2)};
  CHECK(arrays_of(odd) ==
        Names{"density of test", "gradient of test", "samples of cone", "ordered samples of cone"});
  LoadedScene odd_cut = odd;
  odd_cut.cut.model = CutModel::overlap;
  odd_cut.volumes[0].image.labels.assign(odd_cut.volumes[0].image.density.size(), 1);
  CHECK(arrays_of(odd_cut) ==
        Names{"density of test", "labels of test", "carry of test", "first content of test",
              "cut bricks of test", "bricks of the last strokes", "whether they are kept",
              "samples of cone", "ordered samples of cone", "box", "columns inside",
              "overlap ratios", "filtered rows", "live rows", "sample places", "overlap sums",
              "rest rows", "live rest rows"});
  LoadedScene floating = odd_cut;
  floating.servo.numeric = NumericKind::float64;
  CHECK(arrays_of(floating) == Names{"density of test", "labels of test", "gradient of test",
                                     "carry of test", "first content of test", "cut bricks of test",
                                     "bricks of the last strokes", "whether they are kept",
                                     "samples of cone", "overlap box", "refresh planes"});
  odd_cut.tools[0].turns = false;
  const Names unturned = arrays_of(odd_cut);
  CHECK(unturned.count("ordered samples of cone") == 0);
  CHECK(unturned.count("table of cone") == 1);
}

}  // namespace kerf::scene_costs_test
