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

/// The fraction of one straight move in one volume along which spheres are free
/// (docs/theory.md 2.3).
///
/// A sphere of radius r is free everywhere in a brick whose distance d is at least r. From a point
/// in it the sphere may move until its centre leaves the brick, or by d - r in any direction,
/// whichever is farther; then the next brick is queried. A move of (x, y, z) voxels therefore takes
/// at most |x|/2 + |y|/2 + |z|/2 + 4 queries of the map. Each border is passed by 2^-14 voxels, for
/// which the sphere's radius must have room.
template <class N>
class FreePath {
  using S = PointNumber<N>;
  using Fraction = MoveShare<N>;
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

  /// The fraction of the move, at most `to`, up to which a sphere is free that is free up to
  /// `from`. Its centre begins at `start` (fixed: Q15.16) and `needed` is `free_steps_for` its
  /// radius. Counts the remaining map queries down, and ends when none is left.
  [[nodiscard]] Fraction free_up_to(const S (&start)[3], std::int32_t needed, Fraction from,
                                    Fraction to, std::int64_t& queries) const noexcept {
    Fraction fraction = from;
    while (fraction < to && queries > 0) {
      --queries;
      Wide position[3];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if constexpr (N::kIsFixed) {
          position[axis] = start[axis] + (move_[axis] * fraction >> 30);
        } else {
          position[axis] = start[axis] + move_[axis] * fraction;
        }
      }
      const std::int32_t free = distance(position) - needed;
      if (free < 0) return fraction;
      Fraction onward = fraction_of(free);
      // No brick is left later than by the steps across it.
      if (free < 2 * kFreeBrick * kFreeSteps) onward = std::max(onward, leaving(position));
      if (!(fraction + onward > fraction))
        return fraction;  // below the resolution of the number type
      fraction += onward;
    }
    return std::min(fraction, to);
  }

  /// Fraction of the move in which no point moves by more than so many steps of the map.
  [[nodiscard]] Fraction fraction_of(std::int32_t steps) const noexcept {
    return step_ * Fraction(steps);
  }

 private:
  /// So far beyond its border a brick is left: 2^-14 voxels.
  static constexpr auto kPast = N::kIsFixed ? Wide(4) : Wide(0x1p-14);

  [[nodiscard]] static std::int32_t voxel_of(Wide position) noexcept {
    if constexpr (N::kIsFixed) {
      return static_cast<std::int32_t>(position >> 16);
    } else {
      const auto voxel = static_cast<std::int32_t>(position);
      return Wide(voxel) > position ? voxel - 1 : voxel;
    }
  }

  /// Of the brick that holds a position.
  [[nodiscard]] std::int32_t distance(const Wide (&position)[3]) const noexcept {
    return free_.at(voxel_of(position[0]), voxel_of(position[1]), voxel_of(position[2]));
  }

  /// Fraction of the move at which its line leaves the brick of `position`.
  [[nodiscard]] Fraction leaving(const Wide (&position)[3]) const noexcept {
    const Wide edge = N::kIsFixed ? Wide{kFreeBrick} * 65536 : Wide{kFreeBrick};
    Fraction soonest = kWholeMove<N>;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Fraction fraction{};
      if constexpr (N::kIsFixed) {
        const std::int64_t in = position[axis] & (edge - 1);
        fraction = ((move_[axis] < 0 ? in : edge - in) + kPast) * inverse_[axis] >> 16;
      } else {
        const std::int32_t voxel = voxel_of(position[axis]);
        const S in = position[axis] - S(voxel - (voxel & (kFreeBrick - 1)));
        fraction = ((move_[axis] < 0 ? in : edge - in) + kPast) * inverse_[axis];
      }
      soonest = std::min(soonest, fraction);
    }
    return soonest;
  }

  const FreeSpaceMap& free_;
  Wide move_[3] = {};
  Fraction inverse_[3] = {};  ///< fraction of the move that is one voxel along an axis
  Fraction step_{};           ///< that is one step of the map
};

/// A group of samples a unit apart is a patch of 4 by 4, whose sphere is less than 3 units wide; a
/// wider one lies along a rim or is a remainder. If the sphere of a group is not free, some of its
/// samples may still be.
inline constexpr std::int32_t kLooseGroup = 3 * kFreeSteps;

/// The fraction of a move, at most `most`, up to which all groups of a tool are free that are free
/// up to `fraction`; `centre`: of the tool at the start. Advances all groups in lock-step with
/// doubling step length, so that an early hit bounds the work spent on the others, and the result
/// so far holds when no map query is left. Begins with the group `nearest`, and stores the group
/// that stopped it there, because it will probably stop the next move too. A result below one voxel
/// is useless, since a step of the sweep is as long.
template <class N>
[[nodiscard]] MoveShare<N> free_share_of_groups(const PointTable<N>& table,
                                                const PointPositions<N>& positions,
                                                const PointNumber<N> (&centre)[3],
                                                const FreePath<N>& way, MoveShare<N> fraction,
                                                MoveShare<N> most, std::int32_t& nearest,
                                                std::int64_t& queries) noexcept {
  using Fraction = MoveShare<N>;
  const auto go = [&](const PointNumber<N>* const(&offset)[3], std::int32_t i, std::int32_t needed,
                      Fraction from, Fraction to) {
    return way.free_up_to(
        {place_at<N>(centre[0], offset[0][i]), place_at<N>(centre[1], offset[1][i]),
         place_at<N>(centre[2], offset[2][i])},
        needed, from, to, queries);
  };
  const std::int32_t first = nearest;
  const Fraction least = way.fraction_of(kFreeSteps);
  Fraction ahead = 4 * least;
  for (bool stopped = false; !stopped && fraction < most; ahead *= 2) {
    const Fraction to = std::min(fraction + ahead, most);
    Fraction end = to;
    for (std::int32_t k = 0; k < table.groups && end > std::max(fraction, least); ++k) {
      const std::int32_t group = (first + k) % table.groups;
      Fraction free = go(positions.middle, group, table.needed[group], fraction, end);
      if (free < end && table.needed[group] > kLooseGroup) {
        const Fraction from = free;
        free = end;
        const std::int32_t after = std::min((group + 1) * kPointGroup, table.count);
        for (std::int32_t i = group * kPointGroup; i < after && free > fraction; ++i) {
          free = go(positions.offset_vox, i, table.needed_sample, from, free);
        }
      }
      if (free < end) nearest = group;
      end = free;
    }
    if (queries == 0 || end <= least) return fraction;
    stopped = end < to;
    fraction = end;
  }
  return fraction;
}

}  // namespace kerf
