// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <utility>

#include "controller/kernel/overlap_methods.hpp"
#include "controller/kernel/proxy/contact_query.hpp"
#include "controller/plan/tables/free_brick_map.hpp"
#include "controller/plan/tables/point_shell_table.hpp"
#include "controller/plan/tables/sample_tables.hpp"
#include "controller/tool/surface_samples.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "lab/bench/kernel_bench.hpp"
#include "lab/rig/bench_scene.hpp"
#include "lab/run/lab_run.hpp"

namespace kerf {
namespace {

using namespace bench;

constexpr int kSize = 16;  ///< of the ball
constexpr std::int32_t kBrick = 8, kBrickVoxels = kBrick * kBrick * kBrick;

/// A volume in bricks of 8^3, x fastest within and among them.
class Bricks {
 public:
  Bricks(const VoxelGrid& grid, std::span<const Density> density)
      : nx_((grid.nx + kBrick - 1) / kBrick), ny_((grid.ny + kBrick - 1) / kBrick) {
    const std::int32_t nz = (grid.nz + kBrick - 1) / kBrick;
    voxels_.resize(VoxelGrid{nx_, ny_, nz}.voxel_count() * kBrickVoxels);
    for (std::int32_t z = 0; z < grid.nz; ++z) {
      for (std::int32_t y = 0; y < grid.ny; ++y) {
        for (std::int32_t x = 0; x < grid.nx; ++x) {
          voxels_[row(x / kBrick, y, z) + static_cast<std::size_t>(x % kBrick)] =
              density[grid.index(x, y, z)];
        }
      }
    }
  }

  /// The bricks' rows that hold a box within the volume, whole, re-centred as the servo does:
  /// nothing is shifted, which a tick would also have to do.
  void copy_box(VoxelIndex origin, VoxelIndex size, std::int16_t* out) const {
    const std::int32_t first = origin.x / kBrick, last = (origin.x + size.x - 1) / kBrick;
    for (std::int32_t z = origin.z; z < origin.z + size.z; ++z) {
      for (std::int32_t y = origin.y; y < origin.y + size.y; ++y) {
        for (std::int32_t b = first; b <= last; ++b, out += kBrick) {
          std::array<std::uint64_t, 2> part;
          std::memcpy(part.data(), voxels_.data() + row(b, y, z), sizeof part);
          for (std::uint64_t& half : part) half ^= 0x8000800080008000U;
          std::memcpy(out, part.data(), sizeof part);
        }
      }
    }
  }

 private:
  [[nodiscard]] std::size_t row(std::int32_t brick_x, std::int32_t y, std::int32_t z) const {
    const VoxelGrid bricks{nx_, ny_, 0};
    return bricks.index(brick_x, y / kBrick, z / kBrick) * kBrickVoxels +
           static_cast<std::size_t>((z % kBrick * kBrick + y % kBrick) * kBrick);
  }

  std::int32_t nx_, ny_;
  std::vector<Density> voxels_;
};

class LayoutBench {
 public:
  explicit LayoutBench(const std::function<void(const KernelRow&)>& add_row)
      : add_row_(add_row),
        set_(**kernel_sets()),
        tool_(tool_of(kSize, Shape::ball), kExactFarid, set_) {
    memory_.hold(tool_.table().size, true);
    bricks_.resize(total_bytes(memory_.arrays()));
  }

  void copies() {
    const VoxelGrid grid{256, 256, 161};
    const auto density = ball_in(grid);
    const Bricks bricks(grid, density);
    const AlignedTable& table = tool_.table();
    const BoxScratch scratch = memory_.view();
    for (const bool cold : {false, true}) {
      const int count = cold ? 200 : 4000;
      const auto origin = [&](int i) -> VoxelIndex {
        const Place p = around(grid, kSize, i, count);
        const auto low = [](double at) { return static_cast<std::int32_t>(at) - 10; };
        return {low(p[0]), low(p[1]), low(p[2])};
      };
      const std::string name = cold ? "copy/ball16/cold" : "copy/ball16";
      baseline_ns_ = 0;
      row(name, "linear", cold, count, [&](int i) {
        set_.copy_box(table, grid, density.data(), origin(i), scratch);
        use(scratch.box[100]);
      });
      row(name, "bricks", cold, count, [&](int i) {
        bricks.copy_box(origin(i), table.box, bricks_.data());
        use(bricks_[100]);
      });
    }
  }

  void sizes() {
    constexpr int kCount = 1000;
    std::array<double, 2> baseline_ns{};  // contact, mill: of the smallest volume
    for (const VoxelGrid grid : {VoxelGrid{128, 128, 80}, {256, 256, 161}, {512, 512, 512}}) {
      auto density = ball_in(grid);
      const std::string size =
          std::to_string(grid.nx) + "x" + std::to_string(grid.ny) + "x" + std::to_string(grid.nz);
      const BoxScratch scratch = memory_.view();
      const auto tick = [&](int i) {
        return AlignedTick(set_, tool_.table(), scratch, grid, density,
                           pose_of(around(grid, kSize, i, kCount), kUnturned));
      };
      std::vector<std::uint16_t> carry(static_cast<std::size_t>(tool_.table().row_lanes));
      const auto rate = removal_rate<FixedNumbers>(1.0 / 65536, false);
      baseline_ns_ = baseline_ns[0];
      row("contact/ball16/" + size, set_.name, false, kCount,
          [&](int i) { use(tick(i).contact().x); });
      baseline_ns[0] = baseline_ns_;
      baseline_ns_ = baseline_ns[1];
      row("mill/ball16/" + size, set_.name, false, kCount, [&](int i) {
        const AlignedTick at = tick(i);
        use(at.contact().x);
        use(at.mill(rate, carry).modification.x);
      });
      baseline_ns[1] = baseline_ns_;
    }
  }

  [[nodiscard]] std::vector<KernelRow> rows() && { return std::move(rows_); }

 private:
  template <class Tick>
  void row(const std::string& name, const char* kernels, bool cold, int count, Tick&& tick) {
    const TickTimes times = time_ticks(
        count,
        [&] {
          if (cold) sweep_cache();
        },
        tick);
    if (baseline_ns_ == 0) baseline_ns_ = times.p50_ns;
    rows_.push_back({name, "fixed", kernels, times.p50_ns, times.p99_ns, baseline_ns_,
                     tool_.bytes() + total_bytes(memory_.arrays())});
    add_row_(rows_.back());
  }

  const std::function<void(const KernelRow&)>& add_row_;
  const KernelSet& set_;
  AlignedTool tool_;
  BoxMemory memory_;
  std::vector<std::int16_t> bricks_;  ///< the copy of bricks
  double baseline_ns_ = 0;
  std::vector<KernelRow> rows_;
};

constexpr VoxelGrid kGrid{256, 256, 161};
constexpr int kTicks = 2000;

/// A volume of voxels of one unit, ready to be queried.
struct Solid {
  explicit Solid(std::vector<Density> voxels)
      : density(std::move(voxels)), map(kGrid, density, 1) {}

  [[nodiscard]] ContactVolume<FixedNumbers> seen_by(TransformedShell<FixedNumbers>& memory) const {
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
    const PointShellTable<FixedNumbers> samples(surface_samples(tool, 1), tool.round,
                                                close_samples(tool, 1));
    const auto slide = [](int i) { return around(kGrid, 16, i, kTicks); };
    const auto at_depth = [](double z) {
      return [z](int i) -> Place { return {24 + 0.05 * i, 128.3, z}; };
    };
    queries("query/" + name + "/slide", samples, ball_, slide);
    queries("query/" + name + "/half", samples, half_, at_depth(96.6));
    queries("query/" + name + "/immersed", samples, half_, at_depth(66.8));
    rows("turn/" + name, samples, half_,
         [](ContactQuery<FixedNumbers>& query, int /*i*/) { query.orient({}); });
  }

  [[nodiscard]] std::vector<KernelRow> rows() && { return std::move(rows_); }

 private:
  template <class PlaceAt>
  void queries(const std::string& name, const PointShellTable<FixedNumbers>& samples,
               const Solid& solid, PlaceAt&& place) {
    rows(name, samples, solid, [&](ContactQuery<FixedNumbers>& query, int i) {
      use(query.query(unit_place(place(i))).depth.raw());
    });
  }

  /// One row for each instruction set, the plainest first.
  template <class Tick>
  void rows(const std::string& name, const PointShellTable<FixedNumbers>& samples,
            const Solid& solid, Tick&& tick) {
    const PointShell<FixedNumbers> point_shell = samples.point_shell();
    TransformedShell<FixedNumbers> memory;
    memory.hold(point_shell);
    const ContactVolume<FixedNumbers> volume = solid.seen_by(memory);
    std::vector<const KernelSet*> sets;
    for (auto set = kernel_sets(); *set != nullptr; ++set) sets.push_back(*set);
    std::reverse(sets.begin(), sets.end());
    double plain_p50_ns = 0;
    for (const KernelSet* set : sets) {
      ContactQuery<FixedNumbers> query(*set, point_shell, std::span(&volume, 1));
      query.orient({});
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

std::vector<KernelRow> bench_layout(const std::function<void(const KernelRow&)>& add_row) {
  LayoutBench bench(add_row);
  bench.copies();
  bench.sizes();
  return std::move(bench).rows();
}

std::vector<KernelRow> bench_queries(const std::function<void(const KernelRow&)>& add_row) {
  QueryBench bench(add_row);
  bench.tool("ball16", "ball", 8, 16);
  bench.tool("cylinder", "cylinder", 5, 16);
  return std::move(bench).rows();
}

}  // namespace kerf
