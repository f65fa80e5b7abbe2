// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstring>

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/kernel_shapes.hpp"
#include "controller/kernel/sets/splat_loops.hpp"

// The end of every set: weighing and cutting of the covered voxels, with the bits of
// `covered_voxels` and of the list's `take`, as loops that a compiler turns into vectors; and the
// KernelSet itself. Included after all else of a set, also its `weigh_lanes` and `take_lanes`;
// internal linkage, for the reason given at KernelSet.

namespace kerf {
namespace {

/// A loop over lanes: g++ would unroll it before it could turn it into vectors.
#if defined(__clang__)
#define KERF_LANES
#else
#define KERF_LANES _Pragma("GCC unroll 1")
#endif

/// covered times speed / 2^15, in 32 bits.
[[gnu::always_inline]] inline std::uint32_t weight_in_parts(std::uint32_t covered,
                                                            std::uint32_t speed) noexcept {
  return (covered >> 15) * speed + ((covered & 0x7fff) * speed >> 15);
}

/// Sets the materials of a group.
[[gnu::always_inline]] inline void find_materials(const CoverRow& row, CoveredGroup& group) {
  constexpr Label kLast = kMaxCutMaterials - 1;
  group.mixed = false;
  if (row.labels == nullptr) {
    std::memset(group.material, 0, sizeof group.material);
    return;
  }
  alignas(kCoverGroup) Label label[kCoverGroup], low[kCoverGroup], high[kCoverGroup];
  if (group.at >= 0 && group.at + kCoverGroup <= row.label_count) {
    std::memcpy(label, row.labels + group.at, sizeof label);
    std::uint64_t eight[2];
    std::memcpy(eight, label, sizeof eight);
    const std::uint64_t alike = label[0] * std::uint64_t{0x0101'0101'0101'0101};
    if (eight[0] == alike && eight[1] == alike) {  // mostly
      std::memset(group.material, label[0] < kLast ? label[0] : kLast, sizeof label);
      return;
    }
  } else {
    for (std::int32_t i = 0; i < kCoverGroup; ++i) {
      label[i] = group.covered[i] != 0 ? row.labels[group.at + i] : Label{0};
    }
  }
  KERF_LANES
  for (std::int32_t i = 0; i < kCoverGroup; ++i) {
    label[i] = label[i] < kLast ? label[i] : kLast;
    low[i] = group.covered[i] != 0 ? label[i] : kLast;
    high[i] = group.covered[i] != 0 ? label[i] : Label{0};
  }
  Label least = kLast, most = 0;
  KERF_LANES
  for (std::int32_t i = 0; i < kCoverGroup; ++i) {
    least = low[i] < least ? low[i] : least;
    most = high[i] > most ? high[i] : most;
  }
  group.mixed = least != most;
  if (group.mixed) {
    std::memcpy(group.material, label, sizeof label);
  } else {
    std::memset(group.material, most, sizeof label);
  }
}

/// Adds the weights of a group, whose sum is `sum`, to those of its materials.
[[gnu::always_inline]] inline void add_weights(const CoveredGroup& group,
                                               const std::uint32_t (&weight)[kCoverGroup],
                                               std::uint64_t sum,
                                               std::uint64_t* by_material) noexcept {
  if (!group.mixed) {
    by_material[group.material[0]] += sum;
    return;
  }
  KERF_LANES
  for (std::int32_t i = 0; i < kCoverGroup; ++i) by_material[group.material[i]] += weight[i];
}

/// Lists the groups of a row with a covered voxel, at most `room`, and adds their weights. Returns
/// their number.
std::int32_t weigh_row(const CoverRow& row, CoveredGroup* list, std::int32_t room, CoverSums& sums,
                       std::uint64_t* by_material) noexcept {
  sums = {};
  std::int32_t listed = 0;
  for (std::int32_t lane = 0; lane < row.count && listed < room; lane += kCoverGroup) {
    CoveredGroup& group = list[listed];
    CoverSums own;
    if (!weigh_lanes(row, lane, group, own)) continue;
    sums.covered += own.covered;
    sums.covered_number += own.covered_number + own.covered * static_cast<std::uint64_t>(lane);
    sums.weight += own.weight;
    sums.weight_speed += own.weight_speed;
    group.at = row.at + lane;
    group.place[0] = static_cast<std::int16_t>(row.first.x + lane);
    group.place[1] = static_cast<std::int16_t>(row.first.y);
    group.place[2] = static_cast<std::int16_t>(row.first.z);
    find_materials(row, group);
    add_weights(group, group.weight, own.weight, by_material);
    ++listed;
  }
  return listed;
}

/// Computes the weights of what is still covered, and adds them up.
void weigh_again(CoveredGroup* list, std::int32_t count, std::uint64_t* by_material) noexcept {
  for (CoveredGroup* group = list; group != list + count; ++group) {
    std::uint64_t sum = 0;
    KERF_LANES
    for (std::int32_t i = 0; i < kCoverGroup; ++i) {
      group->weight[i] = weight_in_parts(group->covered[i], group->speed[i]);
      sum += group->weight[i];
    }
    add_weights(*group, group->weight, sum, by_material);
  }
}

/// Densities of a group in a volume of `entries`; false if not all lanes are inside: no lane
/// outside is covered.
[[gnu::always_inline]] inline bool read_group(const CoveredGroup& group,
                                              const std::uint16_t* density, std::int64_t entries,
                                              std::uint16_t (&rho)[kCoverGroup]) noexcept {
  if (group.at >= 0 && group.at + kCoverGroup <= entries) {
    std::memcpy(rho, density + group.at, sizeof rho);
    return true;
  }
  KERF_LANES
  for (std::int32_t i = 0; i < kCoverGroup; ++i) {
    rho[i] = group.covered[i] != 0 ? density[group.at + i] : 0;
  }
  return false;
}

/// Adds up the loads of `count` groups at a contact by material, of all voxels and of those that
/// reach `iso`.
void add_loads(const AheadForm<std::int64_t>& form, const CoveredGroup* list, std::int32_t count,
               const std::uint16_t* density, std::int64_t entries, std::uint16_t iso,
               std::uint64_t* ahead_of, std::uint64_t* bearing_of) noexcept {
  constexpr std::int64_t kOne = 1 << 20;
  for (const CoveredGroup* group = list; group != list + count; ++group) {
    const std::int64_t first = form.origin + form.step[0] * group->place[0] +
                               form.step[1] * group->place[1] + form.step[2] * group->place[2];
    if (first <= 0 && first + (kCoverGroup - 1) * form.step[0] <= 0) continue;
    alignas(32) std::uint16_t rho[kCoverGroup];
    static_cast<void>(read_group(*group, density, entries, rho));
    std::uint32_t load[kCoverGroup], borne[kCoverGroup];
    std::uint64_t sum = 0, borne_sum = 0;
    KERF_LANES
    for (std::int32_t i = 0; i < kCoverGroup; ++i) {
      const std::int64_t ahead = first + i * form.step[0];
      const std::int64_t positive = ahead < 0 ? 0 : ahead;
      const auto weight = static_cast<std::uint32_t>((positive > kOne ? kOne : positive) >> 5);
      load[i] = weight_in_parts(group->weight[i], weight);
      borne[i] = rho[i] >= iso ? load[i] : 0;
      sum += load[i];
      borne_sum += borne[i];
    }
    add_weights(*group, load, sum, ahead_of);
    add_weights(*group, borne, borne_sum, bearing_of);
  }
}

/// Takes budgets from `count` groups, of a volume of `entries`.
void take_steps(const CoverSpend& spend, CoveredGroup* list, std::int32_t count,
                std::uint16_t* density, std::int64_t entries, CoverTaken& taken) noexcept {
  for (CoveredGroup* group = list; group != list + count; ++group) {
    alignas(32) std::uint16_t rho[kCoverGroup];
    const std::int64_t at = group->at;
    const bool whole = read_group(*group, density, entries, rho);
    const TakenLanes lost = take_lanes(spend, *group, rho);
    taken.full = taken.full || lost.full;
    if (lost.lanes == 0) continue;
    if (group->mixed) {
      for (std::int32_t i = 0; i < kCoverGroup; ++i)
        taken.steps[group->material[i]] += lost.steps[i];
    } else {
      taken.steps[group->material[0]] += lost.sum;
    }
    if (whole) {  // lanes without a loss are written back unchanged
      std::memcpy(density + at, rho, sizeof rho);
    } else {
      for (std::uint32_t left = lost.lanes; left != 0; left &= left - 1) {
        const int i = __builtin_ctz(left);
        density[at + i] = rho[i];
      }
    }
    const std::int32_t x = group->place[0], y = group->place[1], z = group->place[2];
    const std::int32_t first = x + __builtin_ctz(lost.lanes);
    const std::int32_t end = x + 32 - __builtin_clz(lost.lanes);
    taken.lo.x = first < taken.lo.x ? first : taken.lo.x;
    taken.lo.y = y < taken.lo.y ? y : taken.lo.y;
    taken.lo.z = z < taken.lo.z ? z : taken.lo.z;
    taken.hi.x = end > taken.hi.x ? end : taken.hi.x;
    taken.hi.y = y + 1 > taken.hi.y ? y + 1 : taken.hi.y;
    taken.hi.z = z + 1 > taken.hi.z ? z + 1 : taken.hi.z;
  }
}

/// The functions of this set and those that are the same for all sets.
template <const KernelShape& kShape>
constexpr KernelSet the_set() noexcept {
  static_assert(kShape.lanes == kLanes);
  return {kShape.name,
          kLanes,
          kShape.can_fuse,
          copy_box,
          correlate,
          press,
          cut,
          gather,
          place,
          splat,
          press_sums,
          cover,
          cover_sums,
          weigh_row,
          weigh_again,
          add_loads,
          take_steps,
          place_point_samples,
          sum_point_samples,
          read_point_samples,
          sum_close_samples};
}

}  // namespace
}  // namespace kerf
