// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <span>
#include <vector>

#include "controller/kernel/sampling.hpp"
#include "controller/servo/contact_force.hpp"
#include "controller/servo/force_cut.hpp"
#include "shared/numeric/elementary.hpp"

// Times ticks of the servo step at their highest cost. Load time; cut material stays cut.

namespace kerf {

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
/// is air and every stage does most of its work. Of several such positions, the one nearest to the
/// volume's middle, because no voxel is read past the border.
[[nodiscard]] inline VoxelIndex densest_position(const VoxelGrid& grid,
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
  const VoxelIndex middle{grid.nx / 2, grid.ny / 2, grid.nz / 2};
  const auto off_middle = [&](VoxelIndex at) {
    const std::int64_t x = at.x - middle.x, y = at.y - middle.y, z = at.z - middle.z;
    return x * x + y * y + z * z;
  };
  VoxelIndex best = middle;
  int most = 0;
  for (std::int32_t place = 0; place < kPlaces * kPlaces * kPlaces; ++place) {
    const VoxelIndex at = spread(grid.box(), place, kPlaces);
    int full = 0;
    for (std::int32_t query = 0; query < kTrials * kTrials * kTrials; ++query) {
      const VoxelIndex offset = spread(reach, query, kTrials);
      const VoxelIndex v{at.x + offset.x, at.y + offset.y, at.z + offset.z};
      if (grid.contains(v) && density[grid.index(v.x, v.y, v.z)] != 0) ++full;
    }
    if (full < most || (full == most && off_middle(at) >= off_middle(best))) continue;
    most = full;
    best = at;
  }
  return best;
}

/// A rotation that makes the box around any tool nearly as large as possible: the tool's axis lies
/// along the diagonal of the volume.
template <class N>
[[nodiscard]] constexpr Rotation<N> widest_rotation() {
  using U = typename N::Unit;
  const double a = std::numbers::sqrt2 / 2, b = std::numbers::inv_sqrt3, c = a * b;
  return {{{{U(a), U(b), U(c)}, {U(-a), U(b), U(c)}, {U(0), U(b), U(-2 * c)}}}};
}

/// The ticks that `WorstCaseDriver` measured.
struct WorstTick {
  double median_us = 0, p99_us = 0;
  VoxelIndex box;             ///< that held the tool's cells, in low corners
  std::uint64_t queried = 0;  ///< samples that its queries read, the median
  std::uint64_t covered = 0;  ///< voxels that the last cut by force covered
};

/// Drives tool `t` through the contact and cutting functions of the servo step, at about the
/// highest cost that a hand can cause. The tool cuts at the densest position of volume `v`, in the
/// least favourable orientation, and so slowly that it stays surrounded. With the swept proxy, the
/// hand jumps around that position in every tick and rotates, so that the sweep needs many queries.
/// Each tick covers all volumes. Takes 250 ticks.
template <class N>
class WorstCaseDriver {
  using Real = typename N::Real;
  using Place = WorldVec<Real>;

 public:
  WorstCaseDriver(const ServoPlan<N>& plan, ServoState<N>& state, std::size_t t, std::size_t v)
      : plan_(std::make_unique<ServoPlan<N>>(plan)), state_(state), v_(v) {
    constexpr double kFraction = 1.0 / 4096;
    plan_->removal_rate = removal_rate<N>(kFraction, plan.removal_rate.bent);
    state.active_tool = static_cast<std::uint32_t>(t);
    state.force_cut.spindle.ratio = plan.force_cut.spindle.free_ratio;
    const ToolPlan<N>& tool = plan.tools[t];
    const VolumePlan<N>& volume = plan.volumes[v];
    const VoxelBox reach = reach_of<N>(
        tool.offsets, tool_pose(volume, tool, tool.in_volume[v], volume.position_mm, kWidest));
    size_ = reach.extent();
    dense_ = densest_position(volume.grid, state.volumes[v].density, reach);
    if (tool.turns && !tool.round) at_.rotation = kWidest;
    at_.centre_mm = world({dense_.x + 0.0, dense_.y + 0.3, dense_.z + 0.4});
    at_.normal = at_.press = {{}, typename N::Unit(1), {}};
    at_.plane_count = kMaxPlanes;  // as many contacts as there may be
    at_.planes.fill({relabel<DeviceSpace>(at_.normal), {}, Real(1)});
  }

  /// The swept proxy may get stuck on its way, which depends on the tool. So it approaches from a
  /// corner and from above, and the approach that reads more samples counts.
  WorstTick time() {
    if (!plan_->contact.swept) return time_here(kTicks);
    const double away = 2.0 * (size_.x + size_.y + size_.z);
    const WorstTick corner = time_from({-away, -away, -away});
    const WorstTick above = time_from({dense_.x + 0.0, dense_.y + away, dense_.z + 0.0});
    return above.queried > corner.queried ? above : corner;
  }

 private:
  static constexpr int kTicks = 250;

  WorstTick time_from(const std::array<double, 3>& outside_vox) {
    state_.contact.proxy = {};
    static_cast<void>(contact_and_cut(*plan_, state_, world(outside_vox), kWidest, {}));
    return time_here(kTicks / 2);
  }

  WorstTick time_here(int ticks) {
    // A little above the threshold below which nothing is cut.
    const DeviceVec<Real> press_n{
        {},
        (plan_->tools[state_.active_tool].law.threshold_n + Real(0.05)) * plan_->workspace_scale,
        {}};
    std::vector<double> us;
    std::vector<std::int64_t> queried;
    for (int i = 0; i < ticks; ++i) {
      const Place tip_mm = hand(i);
      const Rotation<N> turn = i % 2 == 0 ? kWidest : identity_rotation<N>();
      const auto began = std::chrono::steady_clock::now();
      const ContactResult<N> contact = contact_and_cut(*plan_, state_, tip_mm, turn, {});
      if (plan_->force_cut.on) {
        static_cast<void>(cut_by_sent_force(*plan_, state_, at_, press_n, true));
      }
      const auto ended = std::chrono::steady_clock::now();
      us.push_back(std::chrono::duration<double, std::micro>(ended - began).count());
      queried.push_back(contact.samples_read);
    }
    std::sort(us.begin(), us.end());
    std::sort(queried.begin(), queried.end());
    const auto n = us.size();
    return {us[n / 2], us[n * 99 / 100], size_, static_cast<std::uint64_t>(queried[n / 2]),
            covered()};
  }

  static constexpr Rotation<N> kWidest = widest_rotation<N>();

  /// World position of `vox` in volume `v`: inverse of `voxel_from_world`, whose rows are
  /// orthogonal.
  [[nodiscard]] Place world(const std::array<double, 3>& vox) const {
    const VolumePlan<N>& volume = plan_->volumes[v_];
    std::array<double, 3> mm{};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& row = volume.voxel_from_world.row[i];
      double square = 0;
      for (const auto x : row) square += static_cast<double>(x) * static_cast<double>(x);
      for (std::size_t j = 0; j < 3; ++j) mm[j] += vox[i] * static_cast<double>(row[j]) / square;
    }
    return volume.position_mm + Place{Real(mm[0]), Real(mm[1]), Real(mm[2])};
  }

  [[nodiscard]] Place hand(int i) const {
    if (!plan_->contact.swept) return world({dense_.x + 0.002 * i, dense_.y + 0.3, dense_.z + 0.4});
    // Nearly half a revolution per tick: each jump crosses the circle, by about its diameter, from
    // another side.
    constexpr double kJumpVox = 15, kTurn = 3.0;
    const double angle = kTurn * i;
    return world({dense_.x + kJumpVox * cosine(angle), dense_.y + kJumpVox * sine(angle),
                  dense_.z + kJumpVox * sine(0.7 * angle)});
  }

  [[nodiscard]] std::uint64_t covered() const {
    if (!plan_->force_cut.on) return 0;
    return cover(*plan_, state_, v_, at_.centre_mm, at_).list.size();
  }

  std::unique_ptr<ServoPlan<N>> plan_;
  ServoState<N>& state_;
  std::size_t v_;
  VoxelIndex size_, dense_;
  ContactResult<N> at_;
};

}  // namespace kerf
