// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "controller/kernel/aligned.hpp"
#include "controller/kernel/contact.hpp"
#include "controller/kernel/gather.hpp"
#include "controller/kernel/splat.hpp"
#include "controller/plan/plan_cost.hpp"
#include "controller/servo/tool_forces.hpp"

namespace kerf {

// Times the stages of single ticks as the servo step calls them, in the order of plan_cost.hpp.
// Load time; what they cut stays cut.

/// Durations of one stage after the other, over many ticks.
class StageLaps {
 public:
  explicit StageLaps(std::size_t stages) : ns_(stages) {}

  void begin() {
    stage_ = 0;
    last_ = Clock::now();
  }
  /// The stage that began with the last call is over; `result` is kept from the optimiser.
  void end_stage(std::int64_t result) {
    sink_ = result;
    const auto now = Clock::now();
    ns_[stage_++].push_back(std::chrono::duration<double, std::nano>(now - last_).count());
    last_ = Clock::now();
  }

  /// Medians in us, without the clock's own time.
  [[nodiscard]] std::vector<double> medians_us() {
    StageLaps empty(kMeasures);
    empty.begin();
    for (std::size_t i = 0; i < kMeasures; ++i) empty.end_stage(0);
    double clock_ns = 1e9;
    for (const auto& ns : empty.ns_) clock_ns = std::min(clock_ns, ns.front());
    std::vector<double> us;
    for (auto& ns : ns_) {
      std::nth_element(ns.begin(), ns.begin() + static_cast<std::ptrdiff_t>(ns.size() / 2),
                       ns.end());
      us.push_back(std::max(ns[ns.size() / 2] - clock_ns, 0.0) / 1000);
    }
    return us;
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMeasures = 64;
  std::vector<std::vector<double>> ns_;
  std::size_t stage_ = 0;
  Clock::time_point last_;
  volatile std::int64_t sink_ = 0;
};

/// The box of voxels around a tool's samples at `pose`, counted from the tool's centre.
template <class N>
[[nodiscard]] VoxelBox reach_of(std::span<const ToolOffset> offsets, ToolPose<N> pose) {
  pose.centre_vox = {};
  VoxelBox reach;
  for (const ToolOffset& offset : offsets) {
    const VoxelIndex low = cell_at<N>(sample_position(pose, offset)).low;
    reach = reach.united({low, {low.x + 1, low.y + 1, low.z + 1}});
  }
  return reach;
}

/// The centre of a tool of this reach where the most density lies within it: there hardly anything
/// is air and every stage does most of its work.
[[nodiscard]] inline VoxelIndex densest_place(const VoxelGrid& grid,
                                              std::span<const Density> density,
                                              const VoxelBox& reach) {
  constexpr std::int32_t kPlaces = 12, kTrials = 8;  // along each axis
  const auto along = [](std::int32_t lo, std::int32_t hi, std::int32_t i, std::int32_t n) {
    return lo + (hi - lo) * (2 * i + 1) / (2 * n);
  };
  const auto spread = [&](const VoxelBox& box, std::int32_t i, std::int32_t n) {
    return VoxelIndex{along(box.lo.x, box.hi.x, i % n, n), along(box.lo.y, box.hi.y, i / n % n, n),
                      along(box.lo.z, box.hi.z, i / n / n, n)};
  };
  VoxelIndex best{grid.nx / 2, grid.ny / 2, grid.nz / 2};
  int most = 0;
  for (std::int32_t place = 0; place < kPlaces * kPlaces * kPlaces; ++place) {
    const VoxelIndex at = spread(grid.box(), place, kPlaces);
    int full = 0;
    for (std::int32_t query = 0; query < kTrials * kTrials * kTrials; ++query) {
      const VoxelIndex offset = spread(reach, query, kTrials);
      const VoxelIndex v{at.x + offset.x, at.y + offset.y, at.z + offset.z};
      if (grid.contains(v) && density[grid.index(v.x, v.y, v.z)] != 0) ++full;
    }
    if (full <= most) continue;
    most = full;
    best = at;
  }
  return best;
}

/// A turn that makes the box around any tool nearly as large as it gets: the tool's axis along the
/// diagonal of the volume.
template <class N>
[[nodiscard]] Rotation<N> widest_rotation() {
  using U = typename N::Unit;
  const double a = std::sqrt(0.5), b = std::sqrt(1.0 / 3), c = std::sqrt(1.0 / 6);
  return {{{{U(a), U(b), U(c)}, {U(-a), U(b), U(c)}, {U(0), U(b), U(-2 * c)}}}};
}

[[nodiscard]] inline std::uint64_t voxels_in(VoxelIndex size) {
  return VoxelGrid{size.x, size.y, size.z}.voxel_count();
}

/// Probes with the tool's centre at a place in volume `v` alone, as many as `samples` are enough
/// for. Inside of the solid no closer look is taken. Returns what they cost.
template <class N>
std::uint64_t query_often(const ServoPlan<N>& plan, const ServoState<N>& state,
                          const PointShell<N>& shell, std::size_t v,
                          VoxelVec<typename N::Real> centre_vox, std::uint64_t samples) {
  ContactVolume<N> volume = state.contact.volumes[v];
  volume.frame = {};  // contact space is the volume's
  for (std::size_t i = 0; i < 3; ++i)
    volume.frame.voxel_from_contact.row[i][i] = typename N::Ratio(1);
  ContactQuery<N> query(*plan.kernels, shell, std::span(&volume, 1));
  const std::int64_t enough = static_cast<std::int64_t>(samples) - query.work().query;
  query.begin_tick();
  query.turn({});
  std::int64_t before = 0;
  do {
    before = query.spent();
    static_cast<void>(query.query(relabel<ContactSpace>(centre_vox)));
  } while (query.spent() <= enough && query.spent() > before);
  return static_cast<std::uint64_t>(query.spent());
}

/// Each stage of tool `t` in volume `v` of the plan, whose `bounds` are given: the tool where the
/// volume is densest, turned as unfavourably as it can be, and a cut so slow that it stays
/// surrounded. Operations are those of the last tick.
template <class N>
[[nodiscard]] std::vector<StageTime> time_stages(const ServoPlan<N>& plan, ServoState<N>& state,
                                                 std::size_t t, std::size_t v, CutModel cut,
                                                 std::vector<StageCost> bounds) {
  constexpr int kTicks = 250;
  constexpr double kFraction = 1.0 / 4096;
  const bool bends = cut == CutModel::overlap_exact;  // at a rate of 0 too
  const auto rate = removal_rate<N>(kFraction, bends);
  const VolumePlan<N>& volume = plan.volumes[v];
  const ToolPlan<N>& tool = plan.tools[t];
  const ToolInVolume<N>& in_volume = tool.in_volume[v];
  VolumeState<N>& memory = state.volumes[v];
  const std::span<const Gradient<N>> gradient = memory.gradient;
  ToolPose<N> pose = tool_pose(volume, tool, in_volume, volume.position_mm, widest_rotation<N>());
  const VoxelIndex place = densest_place(volume.grid, memory.density, reach_of(tool.offsets, pose));
  StageLaps laps(bounds.size());
  const ForceCutPlan<N>& by_force = plan.force_cut;
  std::vector<StageCost> done = std::move(bounds);           // `aligned` does no less but probes
  if (by_force.on) done.resize(done.size() - kForceStages);  // but for what the tool covers
  const std::uint64_t most_queried = done.front().operations;
  std::uint64_t queried = 0;
  std::size_t listed = 0;
  const auto list_and_spend = [&]<class Overlap>(const Overlap& overlap) {
    using Real = typename N::Real;
    const SpindleFrame<N> frame(pose.centre_vox, in_volume.rims_from_voxel, widest_rotation<N>());
    const std::span<const Label> labels = by_force.volume[v].labels;
    Covered<N> covered;
    if constexpr (std::is_same_v<Overlap, BoxOverlap>) {
      covered = covered_groups(*plan.kernels, volume.grid, labels, overlap, frame,
                               state.force_cut.list[v]);
    } else if constexpr (!N::kIsFixed) {
      covered = covered_voxels<N>(volume.grid, std::span<const Density>(memory.density), labels,
                                  overlap, frame, state.force_cut.list[v]);
    }
    listed = covered.list.size();
    laps.end_stage(static_cast<std::int64_t>(listed));
    const auto drive = cut_drive<N>(Real(kFraction), Real(0), typename N::Unit(1));
    laps.end_stage(
        cut_by_force(by_force.volume[v], drive, memory.density, state.force_cut.volume[v], covered)
            .removed.changed.hi.x);
  };
  for (int i = 0; i < kTicks; ++i) {
    using Real = typename N::Real;
    pose.centre_vox = {Real(place.x + 0.002 * i), Real(place.y + 0.3), Real(place.z + 0.4)};
    laps.begin();
    if (plan.contact.swept) {
      queried = query_often(plan, state, tool.swept.shell, v, pose.centre_vox, most_queried);
      laps.end_stage(static_cast<std::int64_t>(queried));
      done.front().operations = queried;
      if (in_volume.plan == Plan::surface) continue;
    }
    if constexpr (N::kIsFixed) {
      const SplatScratch& scratch = state.scratch;
      RemovalRate<N> unbent = rate;  // the bend is timed apart
      unbent.bent = false;
      const auto bend = [&](const TickBox& box) {
        if (!bends) return;
        detail::bend_ratios(box, scratch.tick, rate);
        laps.end_stage(0);
      };
      if (in_volume.plan == Plan::aligned) {
        const AlignedTick tick(*plan.kernels, *in_volume.aligned, scratch.tick, volume.grid,
                               memory.density, pose);
        laps.end_stage(0);
        if (!plan.contact.swept) laps.end_stage(tick.contact().x);
        if (by_force.on) {
          tick.cover();
          laps.end_stage(0);
          list_and_spend(tick.overlap());
        }
        if (!plan.cutting) continue;
        laps.end_stage(tick.mill(unbent, memory.carry).modification.x);
        bend(*in_volume.aligned);
        continue;
      }
      if (in_volume.plan == Plan::splat) {
        const SplatTick tick(*plan.kernels, tool.samples, *plan.taps, scratch, volume.grid,
                             memory.density, pose);
        const TickBox& box = tick.box();
        laps.end_stage(box.row_lanes);
        tick.copy();
        laps.end_stage(0);
        tick.splat();
        laps.end_stage(0);
        if (by_force.on) {
          tick.cover(in_volume.overlap_ratio);
          laps.end_stage(0);
          list_and_spend(tick.overlap());
        } else {
          laps.end_stage(tick.press(in_volume.overlap_ratio).contact.x);
          bend(box);
          laps.end_stage(tick.cut(unbent, memory.carry).changed.hi.x);
        }
        const std::uint8_t* const live = scratch.tick.live;  // touched: little of it is air here
        const std::ptrdiff_t rows = std::ptrdiff_t{box.size.y + 1} * (box.size.z + 1);
        const auto touched = static_cast<std::uint64_t>(std::count(live, live + rows, 1));
        done = splat_stages(tool.offsets.size(), box.size, touched, cut);
        if (plan.contact.swept) sweep_instead(queried, done);
        continue;
      }
      laps.end_stage(gathered_contact(*plan.kernels, tool.samples, volume.grid, gradient, pose).x);
      continue;
    }
    if (!plan.contact.swept) {
      laps.end_stage(
          static_cast<std::int64_t>(contact_sum<N>(volume.grid, gradient, tool.offsets, pose).x));
    }
    if (cut == CutModel::none) continue;
    const VoxelBox inside =
        overlap<N>(volume.grid, tool.offsets, pose, in_volume.overlap_ratio, state.overlap);
    laps.end_stage(inside.hi.x);
    GatherBoxes boxes{voxels_in(state.overlap.box.extent()), voxels_in(inside.extent()), 0};
    if (by_force.on) {
      list_and_spend(state.overlap);
      done = gather_stages(tool.offsets.size(), boxes, cut);
      sweep_instead(queried, done);
      continue;
    }
    laps.end_stage(static_cast<std::int64_t>(
        modification_sum<N>(volume.grid, gradient, memory.density, state.overlap).x));
    const Removed removed =
        remove<N>(volume.grid, memory.density, state.overlap, rate, memory.carry);
    laps.end_stage(removed.changed.hi.x);
    refresh_gradients<N>(plan.kernel, volume.grid, memory.density, removed.changed, memory.gradient,
                         *state.gradient_scratch);
    laps.end_stage(0);
    boxes.refreshed =
        voxels_in(removed.changed.grown(kGradientReach).clipped(volume.grid.box()).extent());
    done = gather_stages(tool.offsets.size(), boxes, cut);
    if (plan.contact.swept) sweep_instead(queried, done);
  }
  if (by_force.on) add_force_stages(listed, done);
  std::vector<StageTime> times;
  for (const double us : laps.medians_us()) times.push_back({us, done[times.size()].operations});
  return times;
}

}  // namespace kerf
