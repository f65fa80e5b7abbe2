// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/kernel/preston_budget.hpp"
#include "controller/kernel/surface_speed.hpp"

namespace kerf {

/// How the tool's surface moves over what it touches, averaged by the part covered.
template <class N>
struct SurfaceDrag {
  /// Direction along the tool's x and z: shorter than 1 where the contact lies around the axis, up
  /// to 1.42 where a tool of few voxels covers some beyond its rim.
  typename N::Unit x{}, z{};
  typename N::Unit arm{};  ///< distance from the axis over the rim radius, kSpeedFloor to 1
};

namespace detail {

/// What `SurfaceDrag` is the mean of. Fixed: terms below 2^38, so 2^18 voxels stay below 2^56.
template <class N>
class DragSums {
 public:
  /// A voxel of covered density `covered`; `weight` is that times the surface's `speed`.
  template <class Covered>
  constexpr void add(Covered covered_density, CutWeight<N> cut_weight, typename N::Weight v,
                     typename SpindleFrame<N>::Place place) noexcept {
    const Sum covered = reduced(covered_density), weight = reduced(cut_weight);
    const auto speed = static_cast<Sum>(v);
    // omega x r of a turn about the tool's y.
    x_ += covered * static_cast<Sum>(SpindleFrame<N>::as_weight(place.z));
    z_ -= covered * static_cast<Sum>(SpindleFrame<N>::as_weight(place.x));
    speed_ += covered * speed;
    arm_ += weight * speed;
    weight_ += weight * static_cast<Sum>(N::kWeightOne);
  }

  [[nodiscard]] constexpr SurfaceDrag<N> mean() const noexcept {
    return {unit(x_, speed_), unit(z_, speed_), unit(arm_, weight_)};
  }

 private:
  using Sum = typename N::Sum;
  using Unit = typename N::Unit;

  template <class Wide>
  [[nodiscard]] static constexpr Sum reduced(Wide covered) noexcept {
    if constexpr (N::kIsFixed) {
      return static_cast<Sum>(covered >> 8);
    } else {
      return covered;
    }
  }
  [[nodiscard]] static constexpr Unit unit(Sum part, Sum whole) noexcept {
    if (!(whole > 0)) return {};
    const bool negative = part < 0;
    const auto size = static_cast<CutWeight<N>>(negative ? -part : part);
    const auto share = share_of<N>(size, static_cast<CutWeight<N>>(whole));
    if constexpr (N::kIsFixed) {
      return Unit::from_raw(static_cast<std::int32_t>(negative ? -share : share));
    } else {
      return negative ? -share : share;
    }
  }

  Sum x_{}, z_{}, speed_{}, arm_{}, weight_{};
};

}  // namespace detail

}  // namespace kerf
