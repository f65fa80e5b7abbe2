// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "controller/kernel/aligned.hpp"
#include "controller/kernel/contact.hpp"
#include "controller/kernel/gather.hpp"
#include "controller/kernel/splat.hpp"
#include "controller/scene/plan_choice.hpp"
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

/// Where the most density lies within reach of a tool of `reach` voxels to each side: there nothing
/// is air and every stage does all of its work.
[[nodiscard]] inline VoxelIndex densest_place(const VoxelGrid& grid,
                                              std::span<const Density> density,
                                              std::int32_t reach) {
  constexpr std::int32_t kPlaces = 12, kProbes = 8;  // along each axis
  const auto along = [](std::int32_t n, std::int32_t i) { return n * (2 * i + 1) / (2 * kPlaces); };
  VoxelIndex best{grid.nx / 2, grid.ny / 2, grid.nz / 2};
  std::uint64_t most = 0;
  for (std::int32_t place = 0; place < kPlaces * kPlaces * kPlaces; ++place) {
    const VoxelIndex at{along(grid.nx, place % kPlaces), along(grid.ny, place / kPlaces % kPlaces),
                        along(grid.nz, place / kPlaces / kPlaces)};
    std::uint64_t sum = 0;
    for (std::int32_t probe = 0; probe < kProbes * kProbes * kProbes; ++probe) {
      const auto offset = [&](std::int32_t i) { return reach * (2 * i + 1 - kProbes) / kProbes; };
      const VoxelIndex v{at.x + offset(probe % kProbes), at.y + offset(probe / kProbes % kProbes),
                         at.z + offset(probe / kProbes / kProbes)};
      if (grid.contains(v)) sum += density[grid.index(v.x, v.y, v.z)] != 0 ? 65536 : 0;
    }
    if (sum > most) {
      most = sum;
      best = at;
    }
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

/// Median of each stage of tool `t` in volume `v` of the plan, in us: the tool where the volume is
/// densest, turned as unfavourably as it can be, and a cut so slow that it stays surrounded.
template <class N>
[[nodiscard]] std::vector<double> time_stages(const ServoPlan<N>& plan, ServoState<N>& state,
                                              std::size_t t, std::size_t v, std::size_t stages) {
  constexpr int kTicks = 250;
  constexpr double kFraction = 1.0 / 4096;
  const auto rate = removal_rate<N>(kFraction, plan.removal_rate.bent);
  const VolumePlan<N>& volume = plan.volumes[v];
  const ToolPlan<N>& tool = plan.tools[t];
  const ToolInVolume<N>& in_volume = tool.in_volume[v];
  VolumeState<N>& memory = state.volumes[v];
  const std::span<const Gradient<N>> gradient = memory.gradient;
  std::int32_t reach = 0;
  for (const ToolOffset& offset : tool.offsets) {
    for (const std::int16_t half_pitches : offset)
      reach = std::max<std::int32_t>(reach, half_pitches / 2);
  }
  const VoxelIndex place = densest_place(volume.grid, memory.density, reach);
  ToolPose<N> pose = tool_pose(volume, tool, in_volume, volume.position_mm, widest_rotation<N>());
  StageLaps laps(stages);
  for (int i = 0; i < kTicks; ++i) {
    using Real = typename N::Real;
    pose.centre_vox = {Real(place.x + 0.002 * i), Real(place.y + 0.3), Real(place.z + 0.4)};
    laps.begin();
    if constexpr (N::kIsFixed) {
      if (in_volume.plan == Plan::aligned) {
        const AlignedTick tick(*plan.kernels, *in_volume.aligned, state.scratch.tick, volume.grid,
                               memory.density, pose);
        laps.end_stage(0);
        laps.end_stage(tick.contact().x);
        if (plan.cutting) laps.end_stage(tick.mill(rate, memory.carry).modification.x);
        continue;
      }
      if (in_volume.plan == Plan::splat) {
        const SplatTick tick(*plan.kernels, tool.samples, *plan.taps, state.scratch, volume.grid,
                             memory.density, pose);
        laps.end_stage(tick.box().row_lanes);
        tick.copy();
        laps.end_stage(0);
        tick.splat();
        laps.end_stage(0);
        laps.end_stage(tick.press(in_volume.overlap_ratio).contact.x);
        laps.end_stage(tick.cut(rate, memory.carry).changed.hi.x);
        continue;
      }
      laps.end_stage(gathered_contact(*plan.kernels, tool.samples, volume.grid, gradient, pose).x);
      continue;
    }
    laps.end_stage(
        static_cast<std::int64_t>(contact_sum<N>(volume.grid, gradient, tool.offsets, pose).x));
    if (!plan.cutting) continue;
    laps.end_stage(
        overlap<N>(volume.grid, tool.offsets, pose, in_volume.overlap_ratio, state.overlap).hi.x);
    laps.end_stage(static_cast<std::int64_t>(
        modification_sum<N>(volume.grid, gradient, memory.density, state.overlap).x));
    const Removed removed =
        remove<N>(volume.grid, memory.density, state.overlap, rate, memory.carry);
    laps.end_stage(removed.changed.hi.x);
    refresh_gradients<N>(plan.kernel, volume.grid, memory.density, removed.changed, memory.gradient,
                         *state.gradient_scratch);
    laps.end_stage(0);
  }
  return laps.medians_us();
}

}  // namespace kerf
