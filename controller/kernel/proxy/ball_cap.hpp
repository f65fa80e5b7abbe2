// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/proxy/contact_peak.hpp"
#include "controller/kernel/proxy/contact_space.hpp"
#include "controller/kernel/proxy/spiral_points.hpp"
#include "controller/kernel/proxy/tool_turn.hpp"
#include "shared/numeric/fixed.hpp"

namespace kerf {

/// Samples on a ball around its contact, which a sharp edge needs for its height.
///
/// An edge touches in a strip about a unit wide, which holds few of the ball's samples; and its
/// trilinear density has summits that are sharper than the edge. A wide cap finds the middle of
/// what touches, a narrow one there, of samples 0.2 units apart, its height: that of any shape
/// (peak_height) and a little, since no sample is at the summit. On 1000 edges of 90 degrees a ball
/// of 8 rests within 0.114 units of the iso-surface; with the wide cap alone within 0.2. By the
/// highest sample instead the force would step by 14 % where the ball slides along an edge, not 3.
inline constexpr std::size_t kCapSamples = 6 * kPointGroup, kSummitSamples = 8 * kPointGroup;
inline constexpr double kCapRadius = 3.25;  ///< units; half the ball's where that is less
inline constexpr double kSummitRadius = 1.25;
inline constexpr double kSummitAbove = 0.1;  ///< units: of the summit over what its samples tell

/// There are caps while the ball's own samples hold their peak to be so near, units: a summit may
/// be 0.5 higher than they tell.
inline constexpr double kCapAbove = 0.6;
inline constexpr double kCapBelow = 0.1;

/// Places (a, a^2 + b^2, b) of the unit disc, each with the same area.
template <class N, std::size_t kCount>
[[nodiscard]] constexpr SpiralArrays<N, kCount> cap_arrays(double radius) noexcept {
  return {radius + 0.1, [](std::size_t i) {
            const double square = (static_cast<double>(i) + 0.5) / kCount;
            return typename SpiralArrays<N, kCount>::Place{
                static_cast<double>(square_root(Q30(square))), square};
          }};
}
template <class N>
inline constexpr auto kCapArrays = cap_arrays<N, kCapSamples>(kCapRadius);
template <class N>
inline constexpr auto kSummitArrays = cap_arrays<N, kSummitSamples>(kSummitRadius);

/// Rows that lay a cap of `radius` on a ball of `reach`, in the direction `out` from its centre,
/// over its radius: two axes across (Duff et al. 2017), and how the ball falls from its tangent
/// plane: by radius^2 / (2 reach) at the rim.
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

/// How far the caps count, 0..1, by the area in touch. On a flat of this slope it is what
/// `count` r^4 sums to over a ball: SUM w = count height^5 / (10 slope reach). Half of it and more
/// is no edge but a ball of 8 or larger, a flat or a crease, which the ball's own samples know
/// better; from 0.35 it is an edge. (A ball of 6 has 0.43, edges of 90 degrees 0.15 to 0.4.)
///
/// Coarse where contact is faint: in fixed point the mean weight has steps of 2^-24, and of a flat
/// at a height of 0.08 it is 1.4 of them (slope 0.5, reach 8), so there they count wholly or not
/// at all. The depth is 0.16 units then, 0.01 N in the default scene.
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
