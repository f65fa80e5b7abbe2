// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/cut_budget.hpp"
#include "controller/kernel/sampling.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/volume/voxel_grid.hpp"

// Speed and direction of the surface of a tool that rotates, at the voxels that it touches.

namespace kerf {

/// Least speed of the tool's surface over that of its rim: abrasive grains at the pole of a ball
/// still cut a little, and a flat end would otherwise never cut its middle (docs/forces.md 6.3).
inline constexpr double kSpeedFloor = 0.08;

/// Square roots of 0, 1/1024 .. 1 as weights of fixed point in the low halves, the difference to
/// the next root in the high halves, for linear interpolation.
inline constexpr std::size_t kRootSteps = 1024;
inline constexpr std::array<std::uint32_t, kRootSteps + 1> kSpeedRoots = [] {
  std::array<std::uint32_t, kRootSteps + 1> roots{};
  for (std::size_t i = 1; i <= kRootSteps; ++i) {
    roots[i] = static_cast<std::uint32_t>(integer_sqrt(std::uint64_t{i} << 20));
    roots[i - 1] |= (roots[i] - roots[i - 1]) << 16;
  }
  return roots;
}();

/// Most rim radii per voxel of a frame, 64 with 20 fraction bits: a thinner tool would fit between
/// two voxels.
inline constexpr std::int64_t kSteepestStep = std::int64_t{64} << 20;

/// Positions of voxels beside the spindle's axis (the y of the tool), in rim radii, and with them
/// the speed and direction of the tool's surface. Made once per tick, tool and volume.
///
/// Fixed: places with 20 fraction bits from steps rounded once, so a place 100 voxels away is off
/// by 1e-4 at most; speeds within 2e-4 of the rim's.
template <class N>
class SpindleFrame {
 public:
  using Weight = typename N::Weight;
  using Sum = typename N::Sum;

  /// Distance from the axis along the tool's x and z; fixed: 20 fraction bits.
  struct Place {
    Sum x{}, z{};

    friend constexpr Place operator+(Place a, Place b) noexcept { return {a.x + b.x, a.z + b.z}; }
  };

  constexpr SpindleFrame() noexcept = default;

  /// `rims_from_voxel` takes voxel edges to rim radii along the world's axes: rotation of the
  /// volume times spacing over the tool's largest radius, its entries below 64. `world_from_tool`
  /// is the turn of the stylus, for round tools too.
  constexpr SpindleFrame(
      VoxelVec<typename N::Real> centre_vox,
      const Transform<typename N::Ratio, WorldSpace, VoxelSpace>& rims_from_voxel,
      const Transform<typename N::Unit, WorldSpace, ToolSpace>& world_from_tool) noexcept
      : centre_(centre_vox) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      across_x_[axis] = along(rims_from_voxel, world_from_tool, 0, axis);
      across_z_[axis] = along(rims_from_voxel, world_from_tool, 2, axis);
    }
  }

  /// Place of a voxel within 2^9 of the centre.
  [[nodiscard]] constexpr Place at(VoxelIndex v) const noexcept {
    return {beside(across_x_, v), beside(across_z_, v)};
  }
  /// From a voxel to the next along x.
  [[nodiscard]] constexpr Place step() const noexcept {
    return {static_cast<Sum>(across_x_[0]), static_cast<Sum>(across_z_[0])};
  }

  static constexpr Weight kFloor = static_cast<Weight>(kSpeedFloor * double(N::kWeightOne));

  /// Speed of the tool's surface there over its rim's: kSpeedFloor to 1, as a weight.
  [[nodiscard]] static constexpr Weight speed(Place place) noexcept {
    if constexpr (N::kIsFixed) {
      const Sum x = std::clamp<Sum>(place.x, -kOne, kOne);
      const Sum z = std::clamp<Sum>(place.z, -kOne, kOne);
      const Sum square = std::min<Sum>((x * x + z * z) >> 15, kRootEnd);  // 25 fraction bits
      const std::uint32_t found = kSpeedRoots[static_cast<std::size_t>(square >> 15)];
      const Sum root = found & 0xffff, rise = found >> 16;
      return std::max(kFloor, static_cast<Weight>(root + (rise * (square & 0x7fff) >> 15)));
    } else {
      const Sum distance = square_root(place.x * place.x + place.z * place.z);
      return std::clamp(distance, kFloor, N::kWeightOne);
    }
  }

 private:
  using Step = typename N::Step;
  static constexpr Sum kOne = N::kIsFixed ? Sum(1 << 20) : Sum(1);

  static constexpr Sum kRootEnd = Sum(kRootSteps << 15);  // 25 fraction bits, of fixed point

  /// Rim radii along axis `b` of the tool per voxel along axis `a`.
  static constexpr Step along(
      const Transform<typename N::Ratio, WorldSpace, VoxelSpace>& rims_from_voxel,
      const Transform<typename N::Unit, WorldSpace, ToolSpace>& world_from_tool, std::size_t b,
      std::size_t a) noexcept {
    Sum sum{};
    for (std::size_t w = 0; w < 3; ++w) {
      if constexpr (N::kIsFixed) {  // Q24 * Q30 = Q54, three terms below 2^60
        sum += Sum{rims_from_voxel.row[w][a].raw()} * world_from_tool.row[w][b].raw();
      } else {
        sum += rims_from_voxel.row[w][a] * world_from_tool.row[w][b];
      }
    }
    if constexpr (N::kIsFixed) {
      return static_cast<Step>(
          std::clamp(round_shift(sum, 54 - 20), -kSteepestStep, kSteepestStep));
    } else {
      return sum;
    }
  }

  [[nodiscard]] constexpr Sum beside(const std::array<Step, 3>& across,
                                     VoxelIndex v) const noexcept {
    if constexpr (N::kIsFixed) {  // Q20 * Q16: steps up to 2^26, distances below 2^25
      const auto term = [](Step step, std::int32_t at, Q16 centre) {
        return std::int64_t{step} * ((std::int64_t{at} << 16) - centre.raw());
      };
      return round_shift(term(across[0], v.x, centre_.x) + term(across[1], v.y, centre_.y) +
                             term(across[2], v.z, centre_.z),
                         16);
    } else {
      return across[0] * (Sum(v.x) - centre_.x) + across[1] * (Sum(v.y) - centre_.y) +
             across[2] * (Sum(v.z) - centre_.z);
    }
  }

  VoxelVec<typename N::Real> centre_;
  std::array<Step, 3> across_x_{}, across_z_{};
};

/// Mean motion of the tool's surface over what it touches, weighted by the part covered. Burs turn
/// clockwise as seen from the shaft, which lies along +y.
template <class N>
struct SurfaceDrag {
  /// Direction along the tool's x and z: shorter than 1 if the contact lies around the axis, longer
  /// (below 2) if a tool of few voxels covers some beyond its rim.
  typename N::Unit x{}, z{};
  typename N::Unit lever_ratio{};  ///< distance from the axis over the rim radius, kSpeedFloor to 1
};

/// The drag of a ball. `normal`: direction of the load, out of the solid. `lever_ratio`: mean
/// distance of the contact from the axis, over the rim radius. For any distribution of the load,
/// SUM load_i lever_i is -R times the load, so omega x lever is known without it. Most voxels that
/// a ball covers in its own bore carry no load, and they change sides when the ball moves by a
/// tenth of a voxel.
template <class N>
[[nodiscard]] constexpr SurfaceDrag<N> ball_drag(Vec<typename N::Unit, ToolSpace> normal,
                                                 typename N::Unit lever_ratio) noexcept {
  using Unit = typename N::Unit;
  const Unit from_axis = norm(Vec<Unit, ToolSpace>{normal.x, Unit(0), normal.z});
  const Unit mean = std::max(lever_ratio, from_axis);
  return {normal.z / mean, -normal.x / mean, lever_ratio};
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
    // omega x lever with omega along -y.
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
    return {along(x_), along(z_), unit_fraction_of<N>(weight_speed_, weight_)};
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
    const Unit share = unit_fraction_of<N>(std::min(length, weight_ + weight_ / 2), weight_);
    return negative ? -share : share;
  }

  Sum x_{}, z_{};
  Weight weight_{}, weight_speed_{};
};

}  // namespace detail
}  // namespace kerf
