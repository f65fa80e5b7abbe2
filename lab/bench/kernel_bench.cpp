// SPDX-License-Identifier: Apache-2.0
#include "lab/bench/kernel_bench.hpp"

#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>

#include "controller/kernel/covered_voxels.hpp"
#include "controller/kernel/cut_law.hpp"
#include "controller/kernel/milling.hpp"
#include "controller/kernel/overlap_methods.hpp"
#include "controller/kernel/preston.hpp"
#include "controller/plan/method/tool_bounds.hpp"
#include "controller/plan/tables/sample_tables.hpp"
#include "lab/rig/bench_scene.hpp"
#include "lab/run/lab_run.hpp"

namespace kerf {
namespace {

using namespace bench;

constexpr VoxelGrid kGrid{256, 256, 161};
using Numbers = FixedNumbers;

PaperPose paper_pose(const Place& p, const Matrix& rotation) {
  PaperPose pose{};
  for (std::size_t i = 0; i < 3; ++i) {
    pose.centre_vox[i] = static_cast<float>(p[i]);
    for (std::size_t j = 0; j < 3; ++j) pose.rotation[i][j] = static_cast<float>(rotation[i][j]);
  }
  return pose;
}

/// The tool of a row and its position at each tick.
struct Ticks {
  std::string name;
  std::vector<ToolOffset> tool;
  int count;
  std::function<Place(int)> place;
  bool turned = true;  ///< for the methods that can turn it
  bool can_align = true;
  bool cold = false;
};

constexpr std::size_t kWidest = 40;  ///< voxels that the widest milling tool touches

constexpr std::size_t kPaperBytes = 14;  // of 16 a voxel
constexpr double kEnamelSteps = 2785;    ///< density steps per N and ms, voxels of 0.125 mm

/// The spindle along y, the tool's rim `rim_vox` from it.
SpindleFrame<Numbers> frame_of(const ToolPose<Numbers>& pose, double rim_vox) {
  Transform<Numbers::Ratio, WorldSpace, VoxelSpace> rims;
  Transform<Numbers::Unit, WorldSpace, ToolSpace> upright;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    rims.row[axis][axis] = Numbers::Ratio(1 / rim_vox);
    upright.row[axis][axis] = Numbers::Unit(1);
  }
  return {pose.centre_vox, rims, upright};
}
constexpr std::size_t kGatherBytes = sizeof(Gradient<Numbers>);

class Bench {
 public:
  explicit Bench(const std::function<void(const KernelRow&)>& add_row) : add_row_(add_row) {}

  void contact(const std::vector<Density>& density, const PaperVolume& paper,
               std::span<const Gradient<Numbers>> field, const Ticks& ticks) {
    std::vector<Density> volume = density;
    begin(ticks);
    row("float", "paper", kPaperBytes * kGrid.voxel_count(), [&](int i) {
      use(std::lround(paper.feel(ticks.tool, paper_pose(ticks.place(i), turn(i))).contact[0]));
    });
    row("fixed", "reference", kGatherBytes * kGrid.voxel_count(), [&](int i) {
      use(contact_sum<Numbers>(kGrid, field, ticks.tool, pose_of(ticks.place(i), turn(i))).x);
    });
    const SampleTool samples(ticks.tool, SampleOrder::as_given);
    for (auto set = kernel_sets(); !ticks.can_align && *set != nullptr; ++set) {
      row("fixed", (*set)->name, field.size_bytes() + samples.bytes(), [&](int i) {
        const auto pose = pose_of(ticks.place(i), turn(i));
        use(gathered_contact(**set, samples.table(), kGrid, field, pose).x);
      });
    }
    each_set(false, [&](const KernelSet& set, const AlignedTable& table, const BoxScratch& scratch,
                        std::size_t bytes) {
      row("fixed", set.name, bytes, [&](int i) {
        const auto pose = pose_of(ticks.place(i), kUnturned);
        use(AlignedTick(set, table, scratch, kGrid, volume, pose).contact().x);
      });
    });
  }

  /// A slow cut, so that the tool stays surrounded by material: the costliest tick.
  void mill(const std::vector<Density>& density, const Ticks& ticks) {
    constexpr double kFraction = 1.0 / 4096;
    begin(ticks);
    {
      PaperVolume paper(kGrid, density);
      row("float", "paper", kPaperBytes * kGrid.voxel_count(), [&](int i) {
        use(std::lround(paper
                            .mill(ticks.tool, paper_pose(ticks.place(i), turn(i)),
                                  static_cast<float>(kFraction))
                            .removed));
      });
    }
    const auto rate = removal_rate<Numbers>(kFraction, false);
    {
      std::vector<Density> volume = density;
      std::vector<Gradient<Numbers>> field(kGrid.voxel_count());
      GradientScratch gradient_scratch;
      refresh_gradients<Numbers>(GradientKernel::farid, kGrid, volume, kGrid.box(), field,
                                 gradient_scratch);
      std::vector<Numbers::Weight> memory(kWidest * kWidest * kWidest);
      std::vector<RemovalCarry<Numbers>> carry(64);
      OverlapBox<Numbers> box{memory, {}, 0};
      row("fixed", "reference", kGatherBytes * kGrid.voxel_count(), [&](int i) {
        const auto pose = pose_of(ticks.place(i), turn(i));
        const std::span<const Gradient<Numbers>> gradients = field;
        use(contact_sum<Numbers>(kGrid, gradients, ticks.tool, pose).x);
        overlap<Numbers>(kGrid, ticks.tool, pose, Numbers::kStepOne, box);
        use(modification_sum<Numbers>(kGrid, gradients, volume, box).x);
        const Removed removed = remove<Numbers>(kGrid, volume, box, rate, carry);
        refresh_gradients<Numbers>(GradientKernel::farid, kGrid, volume, removed.changed, field,
                                   gradient_scratch);
      });
    }
    const SampleTool samples(ticks.tool, SampleOrder::scattered);
    SplatMemory memory;
    memory.hold({kWidest, kWidest, kWidest}, ticks.tool.size());
    for (auto set = kernel_sets(); !ticks.can_align && *set != nullptr; ++set) {
      std::vector<Density> volume = density;
      std::vector<std::uint16_t> carry(kWidest + 32);
      const SplatScratch scratch = memory.view();
      row("fixed", (*set)->name, samples.bytes() + total_bytes(memory.arrays()), [&](int i) {
        const auto pose = pose_of(ticks.place(i), turn(i));
        const SplatOutcome out = splat_tick(**set, samples.table(), kExactFarid, scratch, kGrid,
                                            volume, pose, Numbers::kStepOne, rate, carry);
        use(out.felt.contact.x + out.felt.modification.x);
      });
    }
    each_set(true, [&](const KernelSet& set, const AlignedTable& table, const BoxScratch& scratch,
                       std::size_t bytes) {
      std::vector<Density> volume = density;
      std::vector<std::uint16_t> carry(static_cast<std::size_t>(table.row_lanes));
      row("fixed", set.name, bytes, [&](int i) {
        const auto pose = pose_of(ticks.place(i), kUnturned);
        const AlignedTick tick(set, table, scratch, kGrid, volume, pose);
        use(tick.contact().x);
        use(tick.mill(rate, carry).modification.x);
      });
    });
  }

  /// Cutting by force at 1 N, from the overlap to the removal; the reference lists voxel
  /// by voxel. The paper's row is its whole tick of cutting.
  void press(const std::vector<Density>& density, const Ticks& ticks) {
    begin(ticks);
    PaperVolume paper(kGrid, density);
    row("float", "paper", kPaperBytes * kGrid.voxel_count(), [&](int i) {
      use(std::lround(
          paper.mill(ticks.tool, paper_pose(ticks.place(i), kUnturned), 1.0F / 4096).removed));
    });
    PrestonPlan<Numbers> plan;
    plan.rate.fill(force_rate<Numbers>(kEnamelSteps));
    const auto drive = cut_drive<Numbers>({}, Q16(1), Q30(1));
    const auto cut = [&](auto covered, std::vector<Density>& volume, PrestonState<Numbers>& state) {
      const auto out = cut_by_force(plan, drive, std::span<Density>(volume), state, covered);
      use(static_cast<std::int64_t>(out.removed.density_steps));
    };
    {
      std::vector<Density> volume = density;
      PrestonState<Numbers> state;
      std::vector<Numbers::Weight> memory(kWidest * kWidest * kWidest);
      std::vector<CoveredVoxel<Numbers>> list(memory.size());
      OverlapBox<Numbers> box{memory, {}, 0};
      const std::size_t bytes =
          memory.size() * sizeof(Numbers::Weight) + list.size() * sizeof list[0];
      row("fixed", "reference", bytes, [&](int i) {
        const auto pose = pose_of(ticks.place(i), kUnturned);
        overlap<Numbers>(kGrid, ticks.tool, pose, Numbers::kStepOne, box);
        cut(covered_voxels<Numbers>(kGrid, std::span<const Density>(volume), {}, box,
                                    frame_of(pose, 8), std::span(list)),
            volume, state);
      });
    }
    each_set(true, [&](const KernelSet& set, const AlignedTable& table, const BoxScratch& scratch,
                       std::size_t bytes) {
      std::vector<Density> volume = density;
      PrestonState<Numbers> state;
      std::vector<CoveredGroup> list(max_cover_groups(table));
      row("fixed", set.name, bytes + list.size() * sizeof list[0], [&](int i) {
        const auto pose = pose_of(ticks.place(i), kUnturned);
        const AlignedTick tick(set, table, scratch, kGrid, volume, pose);
        tick.cover();
        cut(covered_groups(set, kGrid, {}, tick.overlap(), frame_of(pose, 8), list), volume, state);
      });
    });
  }

  [[nodiscard]] std::vector<KernelRow> rows() && { return std::move(rows_); }

 private:
  void begin(const Ticks& ticks) {
    ticks_ = &ticks;
    baseline_p50_ns_ = 0;
  }

  [[nodiscard]] Matrix turn(int i) const {
    if (!ticks_->turned) return kUnturned;
    return orientation_of(0.3 + 2 * std::numbers::pi * i / ticks_->count, 0.2);
  }

  template <class Run>
  void each_set(bool mills, Run&& run) {
    if (!ticks_->can_align) return;
    for (auto set = kernel_sets(); *set != nullptr; ++set) {
      const AlignedTool tool(ticks_->tool, kExactFarid, **set);
      BoxMemory memory;
      memory.hold(tool.table().size, mills);
      run(**set, tool.table(), memory.view(), tool.bytes() + total_bytes(memory.arrays()));
    }
  }

  template <class Tick>
  void row(const char* numeric, const char* isa, std::size_t bytes, Tick&& tick) {
    const bool cold = ticks_->cold;
    const auto cool = [cold] {
      if (cold) sweep_cache();
    };
    const TickTimes times = time_ticks(ticks_->count, cool, tick);
    if (baseline_p50_ns_ == 0) baseline_p50_ns_ = times.p50_ns;  // the paper is the first row
    rows_.push_back(
        {ticks_->name, numeric, isa, times.p50_ns, times.p99_ns, baseline_p50_ns_, bytes});
    add_row_(rows_.back());
  }

  const std::function<void(const KernelRow&)>& add_row_;
  const Ticks* ticks_ = nullptr;
  double baseline_p50_ns_ = 0;
  std::vector<KernelRow> rows_;
};

/// A tool of `size` voxels on its way around the ball.
Ticks around_ball(const char* name, int size, Shape shape, int count) {
  return {name, tool_of(size, shape), count,
          [size, count](int i) { return around(kGrid, size, i, count); }};
}

}  // namespace

std::vector<KernelRow> bench_kernels(const std::function<void(const KernelRow&)>& add_row) {
  Bench bench(add_row);
  {
    const auto density = ball_in(kGrid);
    const PaperVolume paper(kGrid, density);
    std::vector<Gradient<Numbers>> field(kGrid.voxel_count() + kFieldPad);
    GradientScratch scratch;
    refresh_gradients<Numbers>(GradientKernel::farid, kGrid, density, kGrid.box(), field, scratch);
    const auto contact = [&](const Ticks& ticks) { bench.contact(density, paper, field, ticks); };
    contact(around_ball("contact/ball16/any", 16, Shape::ball, 2000));
    contact(around_ball("contact/ball10/any", 10, Shape::ball, 2000));
    Ticks cube = around_ball("contact/cube16/aligned", 16, Shape::cube, 2000);
    cube.turned = false;
    contact(cube);
    cube = around_ball("contact/cube16/any", 16, Shape::cube, 2000);
    cube.can_align = false;
    contact(cube);
    contact(around_ball("contact/ball32/any", 32, Shape::ball, 400));
    contact(around_ball("contact/ball64/any", 64, Shape::ball, 100));
    Ticks cold = around_ball("contact/ball16/cold", 16, Shape::ball, 150);
    cold.cold = true;
    contact(cold);
  }
  const auto density = densities(kGrid, [](double, double, double z) { return 161 * 0.6 - z; });
  for (const int size : {16, 10}) {
    const std::string ball = "mill/ball" + std::to_string(size);
    bench.mill(density, {ball, tool_of(size, Shape::ball), 400, [size](int i) -> Place {
                           return {size + 4 + 0.1 * i, 128.3, 66.8};
                         }});
    // Half out of the volume at its first x.
    bench.mill(density, {ball + "/border", tool_of(size, Shape::ball), 400, [](int i) -> Place {
                           return {3.3 + 0.001 * i, 128.3, 66.8};
                         }});
  }
  bench.mill(density, {.name = "mill/cube16/any",
                       .tool = tool_of(16, Shape::cube),
                       .count = 400,
                       .place = [](int i) -> Place {
                         return {24 + 0.1 * i, 128.3, 66.8};
                       },
                       .can_align = false});
  // A groove as wide as the ball, which lies in it a quarter of a voxel deep.
  const auto groove = densities(kGrid, [](double, double y, double z) {
    return std::min(96.6 - z, std::hypot(y - 128, z - 92) - 8);
  });
  bench.press(groove, {"preston/ball16/groove", tool_of(16, Shape::ball), 400, [](int i) -> Place {
                         return {24 + 0.1 * i, 128, 91.75};
                       }});
  bench.press(density, {"preston/ball16/inside", tool_of(16, Shape::ball), 400, [](int i) -> Place {
                          return {24 + 0.1 * i, 128.3, 66.8};
                        }});
  return std::move(bench).rows();
}

}  // namespace kerf
