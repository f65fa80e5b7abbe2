// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>

#include "controller/kernel/proxy/contact_peak.hpp"
#include "controller/kernel/proxy/contact_space.hpp"
#include "controller/kernel/proxy/spiral_points.hpp"
#include "controller/kernel/proxy/tool_turn.hpp"
#include "shared/numeric/fixed.hpp"

namespace kerf {

/// Samples of the volume around a contact, which tell its normal to a tool that is no ball.
///
/// What touches beside a rim or a point lies on one side of it, where a curved face has another
/// normal; and the gradient of one cell is up to 2 degrees off, for trilinear density is bent where
/// the ramp of a face ends. Over a disc around the peak, as wide as some cells, both even out. The
/// samples lie on a sphere that is flattened along the normal that is known so far, and so follow
/// it without a jump. A radius of 2 units reaches too far over curved faces (0.8 degrees off on a
/// bump of 40 instead of 0.65); 32 samples are as good on it, but the force steps by 2.2 % of its
/// mean instead of 1.8.
inline constexpr std::size_t kPatchSamples = 4 * kPointGroup;
inline constexpr double kPatchRadius = 1.5;

/// Where the tool touches two faces that look different ways, as the walls of a slot, the mean
/// gradient of its own samples is shorter along the patch's normal than that of the patch. From
/// kAlike of it down to kUnlike the shell's plane, which leads between the two, takes over.
inline constexpr double kAlike = 0.85, kUnlike = 0.65;

/// Of a tool's own samples so many touch, by their weights, where a patch tells the normal and the
/// place of the contact; from kWide on the mean of so many does, which no voxel's noise turns by
/// more than a third of a degree.
inline constexpr double kNarrow = 32, kWide = 64;

/// Points of the unit sphere; a little more reach is for roundings.
template <class N>
inline constexpr SpiralArrays<N, kPatchSamples> kPatchArrays(kPatchRadius + 0.1, [](std::size_t i) {
  const double y = 1 - (2 * static_cast<double>(i) + 1) / kPatchSamples;
  return typename SpiralArrays<N, kPatchSamples>::Place{
      static_cast<double>(square_root(Q30(1 - y * y))), y};
});

/// Takes away what is along a unit vector: 1 - n n^T.
template <class N>
[[nodiscard]] constexpr TurnRows<N> flattened(ContactVec<typename N::Unit> n) noexcept {
  using Unit = typename N::Unit;
  const Unit one(1);
  return {{{one - n.x * n.x, -(n.x * n.y), -(n.x * n.z)},
           {-(n.x * n.y), one - n.y * n.y, -(n.y * n.z)},
           {-(n.x * n.z), -(n.y * n.z), one - n.z * n.z}}};
}

/// 1 where few of a tool's own samples touch, 0 from kWide on. Each counts by its weight over that
/// of the highest.
template <class N>
[[nodiscard]] constexpr typename N::Unit narrowness(const PointSums<N>& sums,
                                                    typename N::Ratio top) noexcept {
  using Unit = typename N::Unit;
  using Ratio = typename N::Ratio;
  using Sum = typename N::Sum;
  const Ratio cube = top * top * top, weight = cube * cube;
  auto of_wide = static_cast<Sum>(kWide);
  if constexpr (N::kIsFixed) {
    of_wide *= std::max(1, weight.raw());
  } else {
    of_wide *= weight;
  }
  const Ratio width = std::min(mean_of<N>(sums.weight, of_wide, 24), Ratio(1));
  return falling_share<N>(Unit(width), 1, kNarrow / kWide);
}

}  // namespace kerf
