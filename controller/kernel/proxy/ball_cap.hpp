// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/proxy/constraint_plane.hpp"
#include "controller/kernel/proxy/contact_peak.hpp"
#include "controller/kernel/proxy/spiral_points.hpp"
#include "controller/kernel/proxy/tool_turn.hpp"
#include "shared/numeric/fixed.hpp"

namespace kerf {

/// The cap: more samples on a ball around its contact, 0.2 units apart, for its height on a sharp
/// edge (docs/theory.md 3.5): by peak_height as of any shape, and a little more, since no sample is
/// at the summit. By the highest sample the force would step by 14 %, not 3, as the ball slides.
inline constexpr std::size_t kCapSamples = 8 * kPointGroup;
inline constexpr double kCapRadius = 1.25;   ///< units; half the ball's where that is less
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
[[nodiscard]] constexpr TurnRows<N> cap_rows(ContactVec<typename N::Unit> out,
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

/// How far the cap counts, 0..1, by the area in touch over that on a flat (docs/theory.md 3.5).
/// With half of it or more it is no edge: a body of radius 8 or larger, a flat or a crease. With
/// 0.35 or less it is one. (A body of radius 6 has 0.43, edges of 90 degrees 0.15 to 0.4.)
///
/// Coarse where contact is faint: in fixed point the mean weight has steps of 2^-24. At a height of
/// 0.08 on a flat (slope 0.5, reach 8) it is 1.4 steps, so the cap counts wholly or not at all.
/// There the hand feels 0.01 N in the default scene.
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
  return falling_share<N>(typename N::Unit(std::min(area, Ratio(1))), 0.5, 0.35);
}

}  // namespace kerf
