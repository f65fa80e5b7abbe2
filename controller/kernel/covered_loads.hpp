// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/kernel/covered_groups.hpp"
#include "controller/kernel/covered_voxels.hpp"

namespace kerf {

// Which of the materials under the tool bear its press (docs/theory.md 6.2). A tool in its own bore
// covers some of the wall all around, but rests on one side of it. A contact is a plane with the
// normal n, out of the solid, through a point of the tool's surface. Voxel j stands h_j over it;
// what lies at the contact is ahead(j) = 1 - h_j / w, where it is positive.
//
// On a bed of even stiffness the pressure goes with the part of the surface's normal along the
// press. Of a ball that is ahead(j) with w = R. The flank, the end and the rim of another tool are
// told by the plane itself: there w is one unit, half of the ramp of a face.

/// A tool's rim radius over w, 1 of a ball; at most.
inline constexpr double kSteepest = 64;

/// A contact of a tool, seen from its centre.
template <class N>
struct BearingPlane {
  WorldVec<typename N::Unit> normal{};
  typename N::Ratio height{};     ///< of its point along the normal, in rim radii: -1 of a ball
  typename N::Ratio steepness{};  ///< rim radius over w
};

/// ahead(j) as a linear form of the voxel's place. Fixed: 20 fraction bits; steps below 2^30,
/// places below 2^13.
template <class N>
[[nodiscard]] constexpr AheadForm<typename N::Sum> ahead_form(
    VoxelVec<typename N::Real> centre_vox,
    const Transform<typename N::Ratio, WorldSpace, VoxelSpace>& rims_from_voxel,
    const BearingPlane<N>& plane) noexcept {
  using Sum = typename N::Sum;
  using Ratio = typename N::Ratio;
  const auto press = [&](typename N::Unit part) { return -(plane.steepness * Ratio(part)); };
  const Ratio along[3] = {press(plane.normal.x), press(plane.normal.y), press(plane.normal.z)};
  AheadForm<Sum> form{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& row = rims_from_voxel.row;
    if constexpr (N::kIsFixed) {  // Q24 * Q24, three terms below 2^59
      Sum sum = 0;
      for (std::size_t i = 0; i < 3; ++i) sum += Sum{row[i][axis].raw()} * along[i].raw();
      form.step[axis] = round_shift(sum, 48 - 20);
    } else {
      form.step[axis] = row[0][axis] * along[0] + row[1][axis] * along[1] + row[2][axis] * along[2];
    }
  }
  const auto& [x, y, z] = centre_vox;
  if constexpr (N::kIsFixed) {  // of the heights Q24 * Q24, below 2^62
    form.origin =
        (Sum{1} << 20) + round_shift(Sum{plane.steepness.raw()} * plane.height.raw(), 48 - 20) -
        round_shift(form.step[0] * x.raw() + form.step[1] * y.raw() + form.step[2] * z.raw(), 16);
  } else {
    form.origin = 1 + plane.steepness * plane.height -
                  (form.step[0] * x + form.step[1] * y + form.step[2] * z);
  }
  return form;
}

/// All that the tool covers lies at the contact.
template <class N>
[[nodiscard]] constexpr AheadForm<typename N::Sum> ahead_everywhere() noexcept {
  return {N::kIsFixed ? typename N::Sum(1 << 20) : typename N::Sum(1), {}};
}

/// Sums of weights times `ahead`, at most 1, by material: what lies at a contact, and what of it
/// reaches the iso. Softer matter bears nothing.
template <class N>
struct CoveredLoads {
  ByMaterial<CutWeight<N>> ahead{}, bearing{};

  friend constexpr bool operator==(const CoveredLoads&, const CoveredLoads&) = default;
};

/// `density` is that of the volume. Work: the list.
template <class N>
[[nodiscard]] constexpr CoveredLoads<N> loads(const CoveredVoxels<N>& covered,
                                              const AheadForm<typename N::Sum>& form,
                                              std::span<const Density> density,
                                              Density iso) noexcept {
  using Sum = typename N::Sum;
  CoveredLoads<N> found;
  for (const CoveredVoxel<N>& voxel : covered.list) {
    Sum ahead = form.origin;
    for (std::size_t axis = 0; axis < 3; ++axis) ahead += form.step[axis] * Sum(voxel.place[axis]);
    const Sum at_most_1 = std::clamp<Sum>(ahead, 0, N::kIsFixed ? Sum(1 << 20) : Sum(1));
    CutWeight<N> load{};
    if constexpr (N::kIsFixed) {
      load = weight_of<N>(voxel.weight, static_cast<typename N::Weight>(at_most_1 >> 5));
    } else {
      load = voxel.weight * at_most_1;
    }
    found.ahead[voxel.material] += load;
    if (density[voxel.at] >= iso) found.bearing[voxel.material] += load;
  }
  return found;
}

/// The same of groups, with the same bits.
[[nodiscard]] inline CoveredLoads<FixedNumbers> loads(const CoveredGroups& covered,
                                                      const AheadForm<std::int64_t>& form,
                                                      std::span<const Density> density,
                                                      Density iso) noexcept {
  CoveredLoads<FixedNumbers> found;
  covered.kernels->add_loads(
      form, covered.list.data(), static_cast<std::int32_t>(covered.list.size()), density.data(),
      static_cast<std::int64_t>(density.size()), iso, found.ahead.data(), found.bearing.data());
  return found;
}

}  // namespace kerf
