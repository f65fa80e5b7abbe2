// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/point_shell/point_sums.hpp"
#include "controller/kernel/point_shell/point_table.hpp"
#include "controller/kernel/proxy/constraint_set.hpp"
#include "controller/kernel/proxy/contact_peak.hpp"
#include "controller/kernel/proxy/contact_space.hpp"
#include "shared/numeric/numbers.hpp"

// Closer samples around a contact: the close samples of a tool, the cap of a ball, and a patch of
// the volume (docs/theory.md 3.5).

namespace kerf {

/// The contact of a tool that is not a ball is refined if its depth is within +-kCloseDepth. At an
/// edge the samples of the point shell report the tool up to 0.4 units higher than it is.
inline constexpr double kCloseDepth = 0.4;  ///< units

/// The close samples around a contact: offsets and normals in the tool's axes, offsets in voxels,
/// and densities.
template <class N>
struct CloseSamples {
  using Array = std::array<PointNumber<N>, kMostClose>;
  static_assert(kMostClose % kPointGroup == 0);

  std::array<Array, 3> offset, normal, offset_vox;
  Array density, window;
  PointNumber<N> middle[3] = {}, radius{};
  std::int32_t count = 0;

  /// Copies the samples of the cells within kCloseRadius of the offset `around`; at most kMostClose
  /// of them, evenly spread.
  constexpr void take(const CloseTable<N>& table, const PointNumber<N> (&around)[3]) noexcept {
    constexpr std::int32_t kFine = 16;  // steps of a cell
    using Number = PointNumber<N>;
    radius = static_cast<Number>(kCloseRadius) * table.edge;
    std::int32_t at[3] = {}, from[3] = {}, to[3] = {};  // steps; cells
    for (std::size_t axis = 0; axis < 3; ++axis) {
      middle[axis] = around[axis];
      const Number from_low = std::max(Number(0), around[axis] - table.low[axis]);
      at[axis] = static_cast<std::int32_t>(std::min(
          from_low * kFine / table.edge, Number(kFine * (table.cells[axis] + kCloseRadius))));
      from[axis] = std::max(std::int32_t{0}, at[axis] / kFine - kCloseRadius);
      to[axis] = std::min(at[axis] / kFine + kCloseRadius + 1, table.cells[axis]);
    }
    const auto square_to = [&](std::size_t axis, std::int32_t cell) {  // of the distance to a cell
      const std::int32_t low = kFine * cell;
      const std::int32_t gap =
          std::max({std::int32_t{0}, low - at[axis] - 1, at[axis] - low - kFine});
      return gap * gap;
    };
    const std::int32_t square = (kFine * kCloseRadius) * (kFine * kCloseRadius);
    const auto each_row = [&](auto&& visit) {  // of cells: its first sample, and the end
      for (std::int32_t z = from[2]; z < to[2]; ++z) {
        for (std::int32_t y = from[1]; y < to[1]; ++y) {
          const std::int32_t* const first = table.first + (z * table.cells[1] + y) * table.cells[0];
          std::int32_t x = from[0], end = to[0];
          const std::int32_t rest = square - square_to(2, z) - square_to(1, y);
          while (x < end && first[x] != first[end] && square_to(0, x) >= rest) ++x;
          while (x < end && first[x] != first[end] && square_to(0, end - 1) >= rest) --end;
          if (x < end) visit(first[x], first[end]);
        }
      }
    };
    std::int32_t all = 0;
    each_row([&](std::int32_t first, std::int32_t end) { all += end - first; });
    std::int32_t seen = 0;  // of all
    count = 0;
    each_row([&](std::int32_t first, std::int32_t end) {
      const std::int32_t more = end - first;
      if (all <= kMostClose) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          std::copy_n(table.offset[axis] + first, more, offset[axis].data() + count);
          std::copy_n(table.normal[axis] + first, more, normal[axis].data() + count);
        }
        count += more;
        return;
      }
      for (; count < kMostClose; ++count) {
        const std::int32_t next = count * all / kMostClose - seen;
        if (next >= more) break;
        const auto slot = static_cast<std::size_t>(count);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          offset[axis][slot] = table.offset[axis][first + next];
          normal[axis][slot] = table.normal[axis][first + next];
        }
      }
      seen += more;
    });
  }
  /// The samples in whole groups. After all densities are read `fade` gives the padding of the last
  /// group the weight 0.
  [[nodiscard]] constexpr PointTable<N> table() noexcept {
    PointTable<N> table;
    table.count = (count + kPointGroup - 1) / kPointGroup * kPointGroup;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (Array* const part : {&offset[axis], &normal[axis]})
        std::fill(part->begin() + count, part->begin() + table.count, PointNumber<N>(0));
      table.offset[axis] = offset[axis].data();
    }
    return table;
  }
  [[nodiscard]] constexpr CloseSampleView<N> fade(const PointTable<N>& table) noexcept {
    std::fill(density.begin() + count, density.begin() + table.count, PointNumber<N>(0));
    CloseSampleView<N> look{
        .count = table.count, .radius = radius, .density = density.data(), .window = window.data()};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      look.offset[axis] = offset[axis].data();
      look.normal[axis] = normal[axis].data();
      look.middle[axis] = middle[axis];
    }
    return look;
  }
  [[nodiscard]] constexpr PointPositions<N> places() noexcept {
    return {{offset_vox[0].data(), offset_vox[1].data(), offset_vox[2].data()}, {}};
  }
};

/// The peak of density that a closeup finds.
template <class N>
struct Closeup {
  typename N::Ratio height{};     ///< 0 if there is no density
  typename N::Ratio offset[3]{};  ///< from the tool's centre to the peak, over the reach; its axes
  typename N::Ratio normal[3]{};  ///< of the tool at the peak, outward; its axes, length near 1
  typename N::Ratio spread{};     ///< of the tool's normals there: 1 - (mean normal)^2
};

/// The approximate position of the peak, as an offset in the tool's axes, from the sums of the
/// point shell. Beside a rim or a point density falls to one side only, so the mean positions with
/// powers 6 and 8 are off by fractions of 1 / (7 + e) and 1 / (9 + e); the two extrapolate to the
/// peak (docs/theory.md 3.5).
template <class N>
constexpr void peak_offset(const PointSums<N>& sums, typename N::Ratio e,
                           PointNumber<N> (&offset)[3]) noexcept {
  using Ratio = typename N::Ratio;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Ratio peak = mean_of<N>(sums.offset[axis], sums.weight, 9);
    if (sums.high > typename N::Sum(0)) {
      const Ratio near = peak;
      peak = mean_of<N>(sums.high_offset[axis], sums.high, 9);
      peak = peak + (peak - near) * ((Ratio(7) + e) / Ratio(2));
    }
    if constexpr (N::kIsFixed) {
      offset[axis] = peak.raw() >> 9;
    } else {
      offset[axis] = peak;
    }
  }
}

/// The peak of density over a tool's surface, from the sums over its close samples: two means, with
/// powers 32 and 64, give e and the summit (docs/theory.md 3.5); its position follows as in
/// peak_offset; and the mean normal with power 16 is that of the tool there.
template <class N>
[[nodiscard]] constexpr Closeup<N> peak_of(const CloseSums<N>& sums) noexcept {
  using Ratio = typename N::Ratio;
  Closeup<N> found;
  if (sums.low.weight <= typename N::Sum(0)) return found;
  constexpr double kLowOne = CloseSums<N>::kLowPower + 1, kHighOne = CloseSums<N>::kHighPower + 1;
  const auto mean = [](const PowerSums<N>& of, typename N::Sum sum) {
    return mean_of<N>(sum, of.weight, 9);
  };
  const Ratio below = mean(sums.low, sums.low.density), above = mean(sums.high, sums.high.density);
  const Ratio e =
      std::clamp(Ratio(kLowOne) * (above - below) / (below - Ratio(kLowOne / kHighOne) * above),
                 Ratio(0), Ratio(2));
  const Ratio summit = above + above * (e / Ratio(kHighOne));
  if constexpr (N::kIsFixed) {
    found.height = Ratio::from_raw(sums.top << 9) * summit;
  } else {
    found.height = sums.top * summit;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Ratio near = mean(sums.low, sums.low.offset[axis]),
                peak = mean(sums.high, sums.high.offset[axis]);
    found.offset[axis] = peak + (peak - near) * ((Ratio(kLowOne) + e) / Ratio(kHighOne - kLowOne));
  }
  Ratio mean_square{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    found.normal[axis] = mean_of<N>(sums.facing.normal[axis], sums.facing.weight, 9);
    mean_square = mean_square + found.normal[axis] * found.normal[axis];
  }
  found.spread = std::max(Ratio(1) - mean_square, Ratio(0));
  return found;
}

/// A small point shell whose samples follow Fibonacci's spiral about the axis y, for caps and
/// patches (docs/theory.md 3.5). It is transformed anew for each use.
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
  /// `place_of(i)`: distance of sample i from the axis, and its position along the axis. No offset
  /// is longer than `longest` units.
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

/// Memory for the positions of a spiral.
template <class N, std::size_t kCount>
struct SpiralPlaces {
  std::array<std::array<PointNumber<N>, kCount>, 3> offset_vox;
  std::array<std::array<PointNumber<N>, SpiralArrays<N, kCount>::kGroups>, 3> middle;

  [[nodiscard]] PointPositions<N> places() noexcept {
    return {{offset_vox[0].data(), offset_vox[1].data(), offset_vox[2].data()},
            {middle[0].data(), middle[1].data(), middle[2].data()}};
  }
};

/// The cap: more samples on a ball around its contact, 0.2 units apart, for its height on a sharp
/// edge (docs/theory.md 3.5): peak_height, and a little more, since no sample is at the summit.
/// With the highest sample instead the force would step by 14 %, not 3, as the ball slides.
inline constexpr std::size_t kCapSamples = 8 * kPointGroup;
inline constexpr double kCapRadius = 1.25;   ///< units; at most half of the ball's radius
inline constexpr double kSummitAbove = 0.1;  ///< units: the summit is so far above its samples

/// Samples (x, x^2 + z^2, z) over the unit disc, each for the same area.
template <class N>
inline constexpr SpiralArrays<N, kCapSamples> kCapArrays(kCapRadius + 0.1, [](std::size_t i) {
  const double square = (static_cast<double>(i) + 0.5) / kCapSamples;
  return typename SpiralArrays<N, kCapSamples>::Place{static_cast<double>(square_root(Q30(square))),
                                                      square};
});

/// Lays a cap of `radius` on a ball of `reach`, in the direction `out` from its centre. The
/// columns, over the radius, are two axes across (Duff et al. 2017) and between them how the ball
/// falls from its tangent plane: by radius^2 / (2 reach) at the rim.
template <class N>
[[nodiscard]] constexpr RotationRows<N> cap_rows(ContactVec<typename N::Unit> out,
                                                 typename N::Real radius,
                                                 typename N::Real reach) noexcept {
  using Unit = typename N::Unit;
  const Unit one(1), sign(out.z < Unit(0) ? -1 : 1);
  const Unit a = -(one / (sign + out.z)), b = out.x * out.y * a;
  const Unit fall = -Unit(radius / (reach + reach));
  return {{{one + sign * out.x * out.x * a, fall * out.x, b},
           {sign * b, fall * out.y, sign + out.y * out.y * a},
           {-(sign * out.x), fall * out.z, -out.y}}};
}

/// Weight of the cap, 0..1, by the area in touch over that on a flat (docs/theory.md 3.5). From
/// half of it on there is no edge: a body of radius 8 or larger, a flat or a crease. Up to 0.35
/// there is one. (A body of radius 6 has 0.43, edges of 90 degrees 0.15 to 0.4.)
///
/// Coarse if contact is faint: in fixed point the mean weight has steps of 2^-24. At a height of
/// 0.08 on a flat (slope 0.5, reach 8) it is 1.4 steps, so the cap counts wholly or not at all.
/// The force is 0.01 N then in the default scene.
template <class N>
[[nodiscard]] constexpr typename N::Unit sharpness(const PointSums<N>& sums, std::int32_t count,
                                                   typename N::Ratio height,
                                                   typename N::Ratio slope,
                                                   typename N::Real reach) noexcept {
  using Ratio = typename N::Ratio;
  const Ratio square = height * height;
  const Ratio touching =
      multiply<Ratio>(mean_of<N>(sums.weight, static_cast<typename N::Sum>(count), 0), reach);
  const Ratio area = Ratio(10) * slope * touching / (square * square * height);
  return falling_ramp<N>(typename N::Unit(std::min(area, Ratio(1))), 0.5, 0.35);
}

/// A patch: samples of the volume around a contact, for the normal of a tool that is no ball
/// (docs/theory.md 3.5).
///
/// The samples of the tool do not give it: beside a rim or a point they lie on one side, where a
/// curved face has another normal. The samples of a patch lie on a sphere that is flattened along
/// the normal known so far, so they follow it without a jump.
///
/// With a radius of 1.5 units the noise of a scan rotates the normal by 2.0 degrees, not 1.4 (rows
/// `sliding on CT with noise, angle`); offsets hold no 2 units in Q15.
inline constexpr std::size_t kPatchSamples = 2 * kPointGroup;
inline constexpr double kPatchRadius = 1.9;

/// If the tool touches two faces with different normals, as the walls of a slot, the mean gradient
/// of its own samples along the patch's normal is shorter than that of the patch. As it falls from
/// kAlike to kUnlike of that, the plane of the point shell, which lies between the two, takes over.
inline constexpr double kAlike = 0.85, kUnlike = 0.65;

/// While up to so many of a tool's own samples touch, counted by weight, the patch gives the normal
/// and the position of the contact. From twice as many on their own mean does: noise of a voxel
/// rotates the mean of so many samples by a third of a degree at most.
inline constexpr double kNarrow = 32;

/// Points of the unit sphere. The reach has a little to spare for roundings.
template <class N>
inline constexpr SpiralArrays<N, kPatchSamples> kPatchArrays(kPatchRadius + 0.1, [](std::size_t i) {
  const double y = 1 - (2 * static_cast<double>(i) + 1) / kPatchSamples;
  return typename SpiralArrays<N, kPatchSamples>::Place{
      static_cast<double>(square_root(Q30(1 - y * y))), y};
});

/// Gradient and roughness of the solid in a patch.
template <class N>
struct Patch {
  ContactVec<typename N::Ratio> gradient{};  ///< the mean; 0 if there is no density
  typename N::Ratio spread{};                ///< of its normals, see below; 0 to 1
};

/// From the means over a patch that is flattened along `normal`.
///
/// Across the normal the gradient g follows from the mean position of the samples, not from their
/// own gradients: those jump at the borders of cells, densities do not. Positions have the variance
/// R^2 / 3 along each axis of the patch, and weights r^6 grow by 6 g / r a unit: the mean position
/// is 2 R^2 g / r (docs/theory.md 3.5).
///
/// The spread of normals, 1 - (mean normal)^2, comes from that of heights, which is free of the
/// voxels' noise in gradients: over a disc of radius a on a ball of curvature k heights have the
/// variance k^2 a^4 / 48 and normals k^2 a^2 / 2, so the spread is 24 / a^2 variances. The height
/// is r over the slope, and at most the width of a face's ramp, 2 units (docs/theory.md 3.5).
template <class N>
[[nodiscard]] constexpr Patch<N> patch_of(const PointMeans<N>& means,
                                          ContactVec<typename N::Unit> normal) noexcept {
  using Ratio = typename N::Ratio;
  const auto along = [](Ratio part, typename N::Unit n) { return multiply<Ratio>(part, n); };
  const Ratio slope = along(means.gradient.x, normal.x) + along(means.gradient.y, normal.y) +
                      along(means.gradient.z, normal.z);
  const Ratio per_place = means.density * static_cast<Ratio>(1 / (2 * kPatchRadius));
  Patch<N> patch{{along(slope, normal.x) + per_place * means.offset.x,
                  along(slope, normal.y) + per_place * means.offset.y,
                  along(slope, normal.z) + per_place * means.offset.z}};
  const Ratio varied = std::max(means.square / means.density / means.density - Ratio(1), Ratio(0));
  const Ratio height = means.density / std::max(norm(patch.gradient), means.density / Ratio(2));
  const auto of_heights = static_cast<Ratio>(24 / (kPatchRadius * kPatchRadius));
  patch.spread = std::min(of_heights * (varied * (height * height)), Ratio(1));
  return patch;
}

/// Weight of the tool's own normal against that of the patch: two surfaces in touch have one
/// normal, and the smoother one gives it best. Position errors rotate a normal by about the root of
/// the spread of its surface; with squares of the spreads a rim, which has no normal of its own,
/// gets no weight. Below kFlat, 1.8 degrees, both are flat, and the patch gives the normal.
inline constexpr double kFlat = 0.001;
template <class N>
[[nodiscard]] constexpr typename N::Unit smoothness(typename N::Ratio tool,
                                                    typename N::Ratio solid) noexcept {
  using Ratio = typename N::Ratio;
  const Ratio rough = solid * solid;
  return typename N::Unit(rough / (rough + tool * tool + static_cast<Ratio>(kFlat * kFlat)));
}

/// 1 - n n^T: removes the component along a unit vector.
template <class N>
[[nodiscard]] constexpr RotationRows<N> flattened(ContactVec<typename N::Unit> n) noexcept {
  using Unit = typename N::Unit;
  const Unit one(1);
  return {{{one - n.x * n.x, -(n.x * n.y), -(n.x * n.z)},
           {-(n.x * n.y), one - n.y * n.y, -(n.y * n.z)},
           {-(n.x * n.z), -(n.y * n.z), one - n.z * n.z}}};
}

/// 1 up to kNarrow samples in touch, 0 from twice as many on. A sample counts by its weight over
/// that of the highest.
template <class N>
[[nodiscard]] constexpr typename N::Unit narrowness(const PointSums<N>& sums,
                                                    typename N::Ratio top) noexcept {
  using Unit = typename N::Unit;
  using Ratio = typename N::Ratio;
  using Sum = typename N::Sum;
  const Ratio cube = top * top * top, weight = cube * cube;
  auto of_wide = static_cast<Sum>(2 * kNarrow);
  if constexpr (N::kIsFixed) {
    of_wide *= std::max(std::int32_t{1}, weight.raw());
  } else {
    of_wide *= weight;
  }
  const Ratio width = std::min(mean_of<N>(sums.weight, of_wide, 24), Ratio(1));
  return falling_ramp<N>(Unit(width), 1, 0.5);
}

}  // namespace kerf
