// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "controller/kernel/preston_budget.hpp"
#include "controller/kernel/surface_speed.hpp"

namespace kerf {

/// Mean motion of the tool's surface over what it touches, weighted by the part covered. Burs turn
/// clockwise as seen from the shaft, which lies along +y.
template <class N>
struct SurfaceDrag {
  /// Direction along the tool's x and z: shorter than 1 where the contact lies around the axis,
  /// longer (below 2) where a tool of few voxels covers some beyond its rim.
  typename N::Unit x{}, z{};
  typename N::Unit arm{};  ///< distance from the axis over the rim radius, kSpeedFloor to 1
};

/// The drag of a ball. `normal`: direction of the load, out of the solid. `arm`: mean distance of
/// the contact from the axis, over the rim radius. Whatever places bear it, SUM load_i arm_i is -R
/// times the load, so omega x arm is known without them. Most of what a ball covers of its own bore
/// bears nothing, and changes sides where the ball moves by a tenth of a voxel.
template <class N>
[[nodiscard]] constexpr SurfaceDrag<N> ball_drag(Vec<typename N::Unit, ToolSpace> normal,
                                                 typename N::Unit arm) noexcept {
  using Unit = typename N::Unit;
  const Unit from_axis = norm(Vec<Unit, ToolSpace>{normal.x, Unit(0), normal.z});
  const Unit mean = std::max(arm, from_axis);
  return {normal.z / mean, -normal.x / mean, arm};
}

namespace detail {

/// What `SurfaceDrag` is the mean of, row by row. Fixed: covered densities and weights have 15
/// fraction bits and add up to less than 2^49.
template <class N>
class DragSums {
 public:
  using Sum = typename N::Sum;
  using Weight = CutWeight<N>;

  /// Sums over voxels of a row, the first of which is number 0.
  struct Row {
    Weight covered{};         ///< density that the tool covers
    Weight covered_number{};  ///< times the voxel's number
    Weight weight{};          ///< covered times the surface's speed
    Weight weight_speed{};    ///< and once more; fixed: with 30 fraction bits
  };

  constexpr void add(const Row& row, typename SpindleFrame<N>::Place first,
                     typename SpindleFrame<N>::Place step) noexcept {
    if (!(row.weight > 0)) return;
    // omega x arm with omega along -y.
    x_ -= moment(row, first.z, step.z);
    z_ += moment(row, first.x, step.x);
    weight_ += row.weight;
    if constexpr (N::kIsFixed) {
      weight_speed_ += row.weight_speed >> 15;
    } else {
      weight_speed_ += row.weight_speed;
    }
  }

  [[nodiscard]] constexpr SurfaceDrag<N> mean() const noexcept {
    if (!(weight_ > 0)) return {};
    return {along(x_), along(z_), unit_share_of<N>(weight_speed_, weight_)};
  }

 private:
  using Unit = typename N::Unit;

  /// SUM covered times place; fixed: 15 fraction bits, rows below 2^56 before the shift.
  static constexpr Sum moment(const Row& row, Sum first, Sum step) noexcept {
    if constexpr (N::kIsFixed) {
      return (static_cast<Sum>(row.covered >> 8) * first +
              static_cast<Sum>(row.covered_number >> 8) * step) >>
             12;
    } else {
      return row.covered * first + row.covered_number * step;
    }
  }
  [[nodiscard]] constexpr Unit along(Sum moment) const noexcept {
    const bool negative = moment < 0;
    const auto length = static_cast<Weight>(negative ? -moment : moment);
    const Unit share = unit_share_of<N>(std::min(length, weight_ + weight_ / 2), weight_);
    return negative ? -share : share;
  }

  Sum x_{}, z_{};
  Weight weight_{}, weight_speed_{};
};

}  // namespace detail

}  // namespace kerf
