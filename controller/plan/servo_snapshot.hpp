// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <utility>
#include <vector>

#include "controller/kernel/preston_budget.hpp"
#include "controller/servo/servo_state.hpp"

namespace kerf {

/// A servo between two ticks: all that the last one hands to the next, as values and copies of its
/// arrays. What is left out is constant (the plan, the maps of free space, which a cut leaves true)
/// or scratch of one tick. Any thread; not for the loop.
class ServoSnapshot {
 public:
  virtual ~ServoSnapshot() = default;

  /// The largest fraction that cutting still owes, in full voxels: of a density step by overlap, of
  /// a voxel by force (preston.hpp).
  [[nodiscard]] virtual double largest_carry() const = 0;
};

[[noreturn]] inline void refuse_snapshot() {
  throw std::invalid_argument(
      "snapshot: is of another scene; restore it into one that was compiled alike");
}

/// Of equal lists of arrays.
template <class Arrays>
void restore_arrays(const Arrays& kept, Arrays& arrays) {
  const auto same = [](const auto& a, const auto& b) { return a.size() == b.size(); };
  if (!std::equal(kept.begin(), kept.end(), arrays.begin(), arrays.end(), same)) refuse_snapshot();
  for (std::size_t i = 0; i < kept.size(); ++i) std::ranges::copy(kept[i], arrays[i].begin());
}

template <class N>
struct SnapshotOf final : ServoSnapshot {
  SnapshotOf(const ServoState<N>& of, std::vector<std::vector<Density>> density,
             std::array<std::vector<Gradient<N>>, kMaxVolumes> gradient,
             std::array<std::vector<RemovalCarry<N>>, kMaxVolumes> carry,
             std::array<std::vector<std::uint64_t>, kMaxVolumes> blocks,
             std::vector<KeptBrick> stroke_pool,
             std::array<std::vector<std::uint32_t>, kMaxVolumes> stroke_bricks)
      : state(of),
        densities(std::move(density)),
        gradients(std::move(gradient)),
        carries(std::move(carry)),
        cut_blocks(std::move(blocks)),
        pool(std::move(stroke_pool)),
        kept_in(std::move(stroke_bricks)) {}

  /// The kept values, with the memory of `here`.
  [[nodiscard]] ServoState<N> state_in(const ServoState<N>& here) const {
    ServoState<N> placed = state;
    placed.volumes = here.volumes;
    placed.overlap = here.overlap;
    placed.gradient_scratch = here.gradient_scratch;
    placed.scratch = here.scratch;
    placed.stroke.pool = here.stroke.pool;
    placed.stroke.kept_in = here.stroke.kept_in;
    placed.contact.volumes = here.contact.volumes;
    placed.contact.behind = here.contact.behind;
    placed.force_cut.list = here.force_cut.list;
    return placed;
  }

  [[nodiscard]] double largest_carry() const override {
    double largest = 0;
    const auto count = [&](double voxels) { largest = std::max(largest, std::abs(voxels)); };
    for (const auto& by_lane : carries) {
      for (const auto owed : by_lane) {
        count(static_cast<double>(owed) / (N::kIsFixed ? 65536.0 : 1.0) / kDensityMax);
      }
    }
    const double voxel = kDensityMax * (N::kIsFixed ? std::ldexp(1.0, kBudgetBits) : 1.0);
    for (const auto& volume : state.force_cut.volume) {
      for (const auto owed : volume.carry) count(static_cast<double>(owed) / voxel);
    }
    return largest;
  }

  ServoState<N> state;  ///< its pointers are of the servo that it was kept of: see `state_in`
  std::vector<std::vector<Density>> densities;                  ///< by volume of the scene
  std::array<std::vector<Gradient<N>>, kMaxVolumes> gradients;  ///< by volume of the plan
  std::array<std::vector<RemovalCarry<N>>, kMaxVolumes> carries;
  std::array<std::vector<std::uint64_t>, kMaxVolumes> cut_blocks;
  std::vector<KeptBrick> pool;
  std::array<std::vector<std::uint32_t>, kMaxVolumes> kept_in;
};

}  // namespace kerf
