// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/covered_groups.hpp"
#include "controller/kernel/covered_voxels.hpp"

namespace kerf {

// Which of the materials under the tool bear its press (docs/theory.md 6.2). A tool in its own bore
// covers some of the wall all around, but rests on one side of it. On a bed of even stiffness the
// pressure goes with the part of the surface's normal along the press: for a ball that is
// ahead(v) = (v - c) . press / R, where it is positive. Other tools count as the ellipsoid of their
// radius and height.

/// The press that `ahead` is made of: `normal` out of the solid, `axis` of the tool, `slimness` its
/// radius over half its height, 1 of a ball, kSlimmest to 1 / kSlimmest.
inline constexpr double kSlimmest = 1.0 / 16;
template <class N>
[[nodiscard]] constexpr WorldVec<typename N::Ratio> scaled_press(
    const WorldVec<typename N::Unit>& normal, const WorldVec<typename N::Unit>& axis,
    typename N::Ratio slimness) noexcept {
  using Ratio = typename N::Ratio;
  const Ratio more = (slimness - Ratio(1)) * Ratio(dot(normal, axis));
  return {-Ratio(normal.x) - more * Ratio(axis.x), -Ratio(normal.y) - more * Ratio(axis.y),
          -Ratio(normal.z) - more * Ratio(axis.z)};
}

/// ahead(v) as a linear form of the voxel's place. Fixed: 20 fraction bits; steps below 2^30,
/// places below 2^13.
template <class N>
[[nodiscard]] constexpr AheadForm<typename N::Sum> ahead_form(
    VoxelVec<typename N::Real> centre_vox,
    const Transform<typename N::Ratio, WorldSpace, VoxelSpace>& rims_from_voxel,
    const WorldVec<typename N::Ratio>& press) noexcept {
  using Sum = typename N::Sum;
  AheadForm<Sum> form{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& row = rims_from_voxel.row;
    if constexpr (N::kIsFixed) {  // Q24 * Q24, three terms below 2^59
      form.step[axis] = round_shift(Sum{row[0][axis].raw()} * press.x.raw() +
                                        Sum{row[1][axis].raw()} * press.y.raw() +
                                        Sum{row[2][axis].raw()} * press.z.raw(),
                                    48 - 20);
    } else {
      form.step[axis] = row[0][axis] * press.x + row[1][axis] * press.y + row[2][axis] * press.z;
    }
  }
  const auto& [x, y, z] = centre_vox;
  if constexpr (N::kIsFixed) {
    form.origin =
        -round_shift(form.step[0] * x.raw() + form.step[1] * y.raw() + form.step[2] * z.raw(), 16);
  } else {
    form.origin = -(form.step[0] * x + form.step[1] * y + form.step[2] * z);
  }
  return form;
}

/// What each material bears: the sum of its weights times `ahead`, 0 to 1. Work: the list.
template <class N>
[[nodiscard]] constexpr ByMaterial<CutWeight<N>> loads(
    const CoveredVoxels<N>& covered, const AheadForm<typename N::Sum>& form) noexcept {
  using Sum = typename N::Sum;
  ByMaterial<CutWeight<N>> load{};
  for (const CoveredVoxel<N>& voxel : covered.list) {
    Sum ahead = form.origin;
    for (std::size_t axis = 0; axis < 3; ++axis) ahead += form.step[axis] * Sum(voxel.place[axis]);
    const Sum at_most_1 = std::clamp<Sum>(ahead, 0, N::kIsFixed ? Sum(1 << 20) : Sum(1));
    if constexpr (N::kIsFixed) {
      load[voxel.material] +=
          weight_of<N>(voxel.weight, static_cast<typename N::Weight>(at_most_1 >> 5));
    } else {
      load[voxel.material] += voxel.weight * at_most_1;
    }
  }
  return load;
}

/// The same of groups, with the same bits.
[[nodiscard]] inline ByMaterial<CutWeight<FixedNumbers>> loads(
    const CoveredGroups& covered, const AheadForm<std::int64_t>& form) noexcept {
  ByMaterial<CutWeight<FixedNumbers>> load{};
  covered.kernels->add_loads(form, covered.list.data(),
                             static_cast<std::int32_t>(covered.list.size()), load.data());
  return load;
}

}  // namespace kerf
