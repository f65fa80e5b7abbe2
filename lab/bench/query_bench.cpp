// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <span>
#include <string>
#include <utility>

#include "controller/kernel/proxy/contact_query.hpp"
#include "controller/plan/tables/free_brick_map.hpp"
#include "controller/plan/tables/tool_points.hpp"
#include "controller/tool/surface_samples.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "lab/bench/kernel_bench.hpp"
#include "lab/rig/bench_scene.hpp"
#include "lab/rig/tick_timer.hpp"

namespace kerf {
namespace {

using namespace bench;

constexpr VoxelGrid kGrid{256, 256, 161};
constexpr int kTicks = 2000;

/// A volume of voxels of one unit, ready to be queried.
struct Solid {
  explicit Solid(std::vector<Density> voxels)
      : density(std::move(voxels)), map(kGrid, density, 1) {}

  [[nodiscard]] ContactVolume<FixedNumbers> seen_by(PlaceMemory<FixedNumbers>& memory) const {
    ContactVolume<FixedNumbers> volume;
    volume.field = {kGrid, density.data(), density_scale(32768), map.bricks()};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      volume.frame.voxel_from_contact.row[axis][axis] = FixedNumbers::Ratio(1);
    }
    volume.places = memory.places();
    return volume;
  }

  std::vector<Density> density;
  FreeBrickMap map;
};

ContactVec<Q16> unit_place(const Place& p) {
  return {Q16(p[0]), Q16(p[1]), Q16(p[2])};
}

class QueryBench {
 public:
  explicit QueryBench(const std::function<void(const KernelRow&)>& add_row) : add_row_(add_row) {}

  void tool(const std::string& name, const char* shape, double radius, double length) {
    const SceneTool tool =
        make_tool(name, shape, {.pitch_mm = 1, .radius_mm = radius, .length_mm = length});
    const ToolPoints<FixedNumbers> samples(surface_samples(tool, 1), tool.round,
                                           close_samples(tool, 1));
    const auto slide = [](int i) { return around(kGrid, 16, i, kTicks); };
    const auto at_depth = [](double z) {
      return [z](int i) -> Place { return {24 + 0.05 * i, 128.3, z}; };
    };
    queries("query/" + name + "/slide", samples, ball_, slide);
    queries("query/" + name + "/half", samples, half_, at_depth(96.6));
    queries("query/" + name + "/immersed", samples, half_, at_depth(66.8));
    rows("turn/" + name, samples, half_,
         [](ContactQuery<FixedNumbers>& query, int /*i*/) { query.turn({}); });
  }

  [[nodiscard]] std::vector<KernelRow> rows() && { return std::move(rows_); }

 private:
  template <class PlaceAt>
  void queries(const std::string& name, const ToolPoints<FixedNumbers>& samples, const Solid& solid,
               PlaceAt&& place) {
    rows(name, samples, solid, [&](const ContactQuery<FixedNumbers>& query, int i) {
      use(query.query(unit_place(place(i))).depth.raw());
    });
  }

  /// One row for each instruction set, the plainest first.
  template <class Tick>
  void rows(const std::string& name, const ToolPoints<FixedNumbers>& samples, const Solid& solid,
            Tick&& tick) {
    const PointShell<FixedNumbers> point_shell = samples.point_shell();
    PlaceMemory<FixedNumbers> memory;
    memory.hold(point_shell);
    const ContactVolume<FixedNumbers> volume = solid.seen_by(memory);
    std::vector<const KernelSet*> sets;
    for (auto set = kernel_sets(); *set != nullptr; ++set) sets.push_back(*set);
    std::reverse(sets.begin(), sets.end());
    double plain_p50_ns = 0;
    for (const KernelSet* set : sets) {
      ContactQuery<FixedNumbers> query(*set, point_shell, std::span(&volume, 1));
      query.turn({});
      const TickTimes times = time_ticks(
          kTicks, [] {}, [&](int i) { tick(query, i); });
      if (plain_p50_ns == 0) plain_p50_ns = times.p50_ns;
      rows_.push_back({name, "fixed", set->name, times.p50_ns, times.p99_ns, plain_p50_ns,
                       samples.bytes() + memory.bytes() + solid.map.bytes()});
      add_row_(rows_.back());
    }
  }

  const std::function<void(const KernelRow&)>& add_row_;
  Solid ball_{ball_in(kGrid)};
  Solid half_{densities(kGrid, [](double, double, double z) { return 161 * 0.6 - z; })};
  std::vector<KernelRow> rows_;
};

}  // namespace

std::vector<KernelRow> bench_queries(const std::function<void(const KernelRow&)>& add_row) {
  QueryBench bench(add_row);
  bench.tool("ball16", "ball", 8, 16);
  bench.tool("cylinder", "cylinder", 5, 16);
  return std::move(bench).rows();
}

}  // namespace kerf
