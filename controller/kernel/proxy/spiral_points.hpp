// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/point_shell/free_bricks.hpp"
#include "controller/kernel/point_shell/point_table.hpp"

namespace kerf {

/// A small point shell whose samples follow Fibonacci's spiral about the axis y: the caps and
/// patches of closer looks (docs/theory.md 3.5). It is laid out anew for each look.
template <class N, std::size_t kCount>
struct SpiralArrays {
  static constexpr std::size_t kGroups = kCount / kPointGroup;
  static_assert(kGroups * kPointGroup == kCount);

  std::array<std::array<PointNumber<N>, kCount>, 3> offset{};
  std::array<PointNumber<N>, kGroups> middle{};
  std::array<std::uint8_t, kGroups> needed{};
  double reach{};

  struct Place {
    double across, along;
  };
  /// `place_of(i)`: how far sample i is from the axis, and where along it. No offset is longer than
  /// `longest` units.
  template <class PlaceOf>
  constexpr SpiralArrays(double longest, PlaceOf place_of) noexcept : reach(longest) {
    // Of the golden angle, pi (3 - sqrt(5)).
    constexpr double kCosine = -0.7373688780783197, kSine = 0.6754902942615238;
    double cosine = 1, sine = 0;
    for (std::size_t i = 0; i < kCount; ++i) {
      const Place place = place_of(i);
      const double at[3] = {place.across * cosine, place.along, place.across * sine};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        offset[axis][i] = static_cast<PointNumber<N>>(at[axis] * (N::kIsFixed ? 32768 : 1));
      }
      const double turned = cosine * kCosine - sine * kSine;
      sine = sine * kCosine + cosine * kSine;
      cosine = turned;
    }
    needed.fill(free_steps_for(reach));
  }

  /// No voxel's edge is shorter than a unit, so `reach` holds in voxels.
  [[nodiscard]] constexpr PointTable<N> table() const noexcept {
    PointTable<N> table;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      table.offset[axis] = offset[axis].data();
      table.middle[axis] = middle.data();
    }
    table.needed = needed.data();
    table.count = static_cast<std::int32_t>(kCount);
    table.groups = static_cast<std::int32_t>(kGroups);
    table.reach = static_cast<PointNumber<N>>(reach * (N::kIsFixed ? 65536 : 1));
    return table;
  }
};

/// Memory of the places of a spiral.
template <class N, std::size_t kCount>
struct SpiralPlaces {
  std::array<std::array<PointNumber<N>, kCount>, 3> offset_vox;
  std::array<std::array<PointNumber<N>, SpiralArrays<N, kCount>::kGroups>, 3> middle;

  [[nodiscard]] PointPlaces<N> places() noexcept {
    return {{offset_vox[0].data(), offset_vox[1].data(), offset_vox[2].data()},
            {middle[0].data(), middle[1].data(), middle[2].data()}};
  }
};

}  // namespace kerf
