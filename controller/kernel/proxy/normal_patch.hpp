// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>

#include "controller/kernel/proxy/constraint_plane.hpp"
#include "controller/kernel/proxy/contact_peak.hpp"
#include "controller/kernel/proxy/spiral_points.hpp"
#include "controller/kernel/proxy/tool_turn.hpp"
#include "shared/numeric/fixed.hpp"

namespace kerf {

/// A patch: samples of the volume around a contact, for the normal of a tool that is no ball
/// (docs/theory.md 3.5).
///
/// The tool's own samples do not tell it. Beside a rim or a point they lie on one side, where a
/// curved face has another normal. The samples of a patch lie on a sphere that is flattened along
/// the normal known so far, so they follow it without a jump.
///
/// With a radius of 1.5 units the noise of a scan turns the normal by 2.0 degrees, not 1.4 (rows
/// `sliding on CT with noise, angle`); offsets hold no 2 units in Q15.
inline constexpr std::size_t kPatchSamples = 2 * kPointGroup;
inline constexpr double kPatchRadius = 1.9;

/// Where the tool touches two faces that look in different directions, as the walls of a slot, the
/// mean gradient of its own samples along the patch's normal is shorter than the patch's. As it
/// falls from kAlike to kUnlike of that, the point shell's plane, which leads between the two,
/// takes over.
inline constexpr double kAlike = 0.85, kUnlike = 0.65;

/// While up to so many of a tool's own samples touch, counted by weight, the patch tells the normal
/// and the place of the contact. From twice as many on their own mean does: of so many samples no
/// voxel's noise turns it by more than a third of a degree.
inline constexpr double kNarrow = 32;

/// Points of the unit sphere. The reach has a little to spare for roundings.
template <class N>
inline constexpr SpiralArrays<N, kPatchSamples> kPatchArrays(kPatchRadius + 0.1, [](std::size_t i) {
  const double y = 1 - (2 * static_cast<double>(i) + 1) / kPatchSamples;
  return typename SpiralArrays<N, kPatchSamples>::Place{
      static_cast<double>(square_root(Q30(1 - y * y))), y};
});

/// What a patch tells of the solid.
template <class N>
struct Patch {
  ContactVec<typename N::Ratio> gradient{};  ///< the mean; 0 where nothing is felt
  typename N::Ratio spread{};                ///< of its normals, see below; 0 to 1
};

/// From the means over a patch that is flattened along `normal`.
///
/// Across the normal the gradient g follows from where the samples' mean place is, not from their
/// own gradients: those jump at the borders of cells, densities do not. Places have the variance
/// R^2 / 3 along each axis of the patch, and weights r^6 grow by 6 g / r a unit: the mean place is
/// 2 R^2 g / r (docs/theory.md 3.5).
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

/// How far the tool's own normal is told, not the patch's: where two surfaces touch, each has the
/// normal of the other, and the smoother one tells it best. Place errors turn a normal by about
/// the root of its surface's spread; squares of the spreads let a rim, whose own normal is none,
/// tell nothing. Below kFlat, 1.8 degrees, both are flat, and the patch tells it.
inline constexpr double kFlat = 0.001;
template <class N>
[[nodiscard]] constexpr typename N::Unit smoothness(typename N::Ratio tool,
                                                    typename N::Ratio solid) noexcept {
  using Ratio = typename N::Ratio;
  const Ratio rough = solid * solid;
  return typename N::Unit(rough / (rough + tool * tool + static_cast<Ratio>(kFlat * kFlat)));
}

/// 1 - n n^T: takes away what lies along a unit vector.
template <class N>
[[nodiscard]] constexpr TurnRows<N> flattened(ContactVec<typename N::Unit> n) noexcept {
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
    of_wide *= std::max(1, weight.raw());
  } else {
    of_wide *= weight;
  }
  const Ratio width = std::min(mean_of<N>(sums.weight, of_wide, 24), Ratio(1));
  return falling_share<N>(Unit(width), 1, 0.5);
}

}  // namespace kerf
