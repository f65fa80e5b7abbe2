// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "controller/kernel/point_shell/point_table.hpp"

namespace kerf {

/// A part of a move, 0..1. Fixed: Q30.
template <class N>
using MoveShare = std::conditional_t<N::kIsFixed, std::int64_t, PointNumber<N>>;
template <class N>
inline constexpr MoveShare<N> kWholeMove = N::kIsFixed ? std::int64_t{1} << 30 : 1;

/// How far spheres may go along one straight move in one volume and have nothing to read
/// (docs/theory.md 2.3).
///
/// A sphere of radius r is free everywhere in a brick whose distance d is at least r. From a place
/// in it the sphere may go to where its centre leaves the brick, and also by d - r in any
/// direction: the farther of both, and there the next brick is looked at. So a way of (x, y, z)
/// voxels takes at most |x|/2 + |y|/2 + |z|/2 + 4 looks. A border is passed by 2^-14 voxels, which
/// the sphere's radius must have room for.
template <class N>
class FreePath {
  using S = PointNumber<N>;
  using Share = MoveShare<N>;
  /// Fixed: voxels in Q15.16 with room for products.
  using Wide = std::conditional_t<N::kIsFixed, std::int64_t, S>;

 public:
  /// `voxels`: the move, at most 2^14 long; `length`: no shorter, above 0 (fixed: both Q15.16).
  FreePath(const FreeSpaceMap& free, const S (&voxels)[3], S length) noexcept : free_(free) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      move_[axis] = voxels[axis];
      const Wide size = std::max(move_[axis], -move_[axis]);
      if constexpr (N::kIsFixed) {
        inverse_[axis] = (std::int64_t{1} << 46) / std::max<Wide>(size, 2);
      } else {
        inverse_[axis] = 1 / std::max(size, S(1e-6));
      }
    }
    if constexpr (N::kIsFixed) {
      step_ = (std::int64_t{1} << 46) / kFreeSteps / length;
    } else {
      step_ = 1 / (kFreeSteps * length);
    }
  }

  /// Up to which share of the move, at most `to`, a sphere is free that is so from its start to
  /// `from`; its centre begins at `start` (fixed: Q15.16) and `needed` is `free_steps_for` its
  /// radius. Counts its looks down, and ends where none is left.
  [[nodiscard]] Share free_up_to(const S (&start)[3], std::int32_t needed, Share from, Share to,
                                 std::int64_t& looks) const noexcept {
    Share share = from;
    while (share < to && looks > 0) {
      --looks;
      Wide place[3];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if constexpr (N::kIsFixed) {
          place[axis] = start[axis] + (move_[axis] * share >> 30);
        } else {
          place[axis] = start[axis] + move_[axis] * share;
        }
      }
      const std::int32_t free = distance(place) - needed;
      if (free < 0) return share;
      Share onward = fraction_of(free);
      // No brick is left later than by the steps across it.
      if (free < 2 * kFreeBrick * kFreeSteps) onward = std::max(onward, leaving(place));
      if (!(share + onward > share)) return share;  // as little as a float cannot tell
      share += onward;
    }
    return std::min(share, to);
  }

  /// Share of the move in which no place goes by more than so many steps of the map.
  [[nodiscard]] Share fraction_of(std::int32_t steps) const noexcept {
    return step_ * Share(steps);
  }

 private:
  /// So far beyond its border a brick is left: 2^-14 voxels.
  static constexpr auto kPast = N::kIsFixed ? Wide(4) : Wide(0x1p-14);

  [[nodiscard]] static std::int32_t voxel_of(Wide place) noexcept {
    if constexpr (N::kIsFixed) {
      return static_cast<std::int32_t>(place >> 16);
    } else {
      const auto voxel = static_cast<std::int32_t>(place);
      return Wide(voxel) > place ? voxel - 1 : voxel;
    }
  }

  /// Of the brick that holds a place.
  [[nodiscard]] std::int32_t distance(const Wide (&place)[3]) const noexcept {
    return free_.at(voxel_of(place[0]), voxel_of(place[1]), voxel_of(place[2]));
  }

  /// Share of the move to where its line leaves the brick of `place`.
  [[nodiscard]] Share leaving(const Wide (&place)[3]) const noexcept {
    const Wide edge = N::kIsFixed ? Wide{kFreeBrick} * 65536 : Wide{kFreeBrick};
    Share soonest = kWholeMove<N>;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Share share{};
      if constexpr (N::kIsFixed) {
        const std::int64_t in = place[axis] & (edge - 1);
        share = ((move_[axis] < 0 ? in : edge - in) + kPast) * inverse_[axis] >> 16;
      } else {
        const std::int32_t voxel = voxel_of(place[axis]);
        const S in = place[axis] - S(voxel - (voxel & (kFreeBrick - 1)));
        share = ((move_[axis] < 0 ? in : edge - in) + kPast) * inverse_[axis];
      }
      soonest = std::min(soonest, share);
    }
    return soonest;
  }

  const FreeSpaceMap& free_;
  Wide move_[3] = {};
  Share inverse_[3] = {};  ///< share of the move that is one voxel along an axis
  Share step_{};           ///< that is one step of the map
};

/// A group of samples a unit apart is a patch of 4 by 4, whose sphere is less than 3 units wide;
/// one that needs more lies along a rim or is a remainder. Where its sphere is not free its samples
/// may be, one by one.
inline constexpr std::int32_t kLooseGroup = 3 * kFreeSteps;

/// Up to which share of a move, at most `most`, the groups of a tool read nothing that read nothing
/// up to `share`; `centre`: of the tool at the start. They go side by side, each time twice as far:
/// so where one meets something soon the others have not gone far, and what is known once no look
/// is left is kept. It begins with the group `nearest`, and leaves there the one that stopped it:
/// most likely it will again. Less than a voxel is worth nothing, as a step of the sweep is as
/// long.
template <class N>
[[nodiscard]] MoveShare<N> free_share_of_groups(const PointTable<N>& table,
                                                const PointPositions<N>& places,
                                                const PointNumber<N> (&centre)[3],
                                                const FreePath<N>& way, MoveShare<N> share,
                                                MoveShare<N> most, std::int32_t& nearest,
                                                std::int64_t& looks) noexcept {
  using Share = MoveShare<N>;
  const auto go = [&](const PointNumber<N>* const(&offset)[3], std::int32_t i, std::int32_t needed,
                      Share from, Share to) {
    return way.free_up_to(
        {place_at<N>(centre[0], offset[0][i]), place_at<N>(centre[1], offset[1][i]),
         place_at<N>(centre[2], offset[2][i])},
        needed, from, to, looks);
  };
  const std::int32_t first = nearest;
  const Share least = way.fraction_of(kFreeSteps);
  Share ahead = 4 * least;
  for (bool stopped = false; !stopped && share < most; ahead *= 2) {
    const Share to = std::min(share + ahead, most);
    Share end = to;
    for (std::int32_t k = 0; k < table.groups && end > std::max(share, least); ++k) {
      const std::int32_t group = (first + k) % table.groups;
      Share free = go(places.middle, group, table.needed[group], share, end);
      if (free < end && table.needed[group] > kLooseGroup) {
        const Share from = free;
        free = end;
        const std::int32_t after = std::min((group + 1) * kPointGroup, table.count);
        for (std::int32_t i = group * kPointGroup; i < after && free > share; ++i) {
          free = go(places.offset_vox, i, table.needed_sample, from, free);
        }
      }
      if (free < end) nearest = group;
      end = free;
    }
    if (looks == 0 || end <= least) return share;
    stopped = end < to;
    share = end;
  }
  return share;
}

}  // namespace kerf
