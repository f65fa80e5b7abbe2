// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "controller/kernel/cover_table.hpp"
#include "controller/kernel/overlap_rows.hpp"
#include "controller/kernel/preston_budget.hpp"
#include "controller/kernel/surface_drag.hpp"
#include "controller/kernel/surface_speed.hpp"

namespace kerf {

/// Indexed by label; without labels all is at 0.
template <class T>
using ByMaterial = std::array<T, kMaxCutMaterials>;

/// covered times speed; fixed: 15 fraction bits.
template <class N, class Covered>
[[nodiscard]] constexpr Covered weight_of(Covered covered, typename N::Weight speed) noexcept {
  if constexpr (N::kIsFixed) {
    return static_cast<Covered>(std::uint64_t{covered} * static_cast<Covered>(speed) >> 15);
  } else {
    return covered * speed;
  }
}

/// A voxel under the tool during one tick.
template <class N>
struct CoveredVoxel {
  using Covered = std::conditional_t<N::kIsFixed, std::uint32_t, typename N::Sum>;

  std::uint32_t at;                   ///< entry of the volume
  std::array<std::int16_t, 3> place;  ///< in the volume
  std::uint16_t material;
  typename N::Weight speed;
  Covered covered;  ///< density that may still leave; fixed: 15 fraction bits
  Covered weight;   ///< times speed
};

/// What there is of each material under the tool in one tick, and how the tool moves over it.
template <class N>
struct CoveredWeights {
  ByMaterial<CutWeight<N>> weight{};  ///< sums of the list's
  ByMaterial<CutWeight<N>> load{};    ///< by which materials share a press: the weights, or `loads`
  CutWeight<N> whole{};               ///< of what each load is a part
  SurfaceDrag<N> drag;

  /// All share the press by their weights.
  constexpr void share_by_weight() noexcept {
    load = weight;
    whole = {};
    for (const CutWeight<N> part : load) whole += part;
  }
};

/// What the tool covers in one tick. The list is in the caller's memory, in z, y, x order.
template <class N>
struct CoveredVoxels : CoveredWeights<N> {
  std::span<CoveredVoxel<N>> list;
};

namespace detail {

/// One run of `covered_voxels`.
template <class N>
class CoverScan {
 public:
  using Place = typename SpindleFrame<N>::Place;

  constexpr CoverScan(const VoxelGrid& grid, std::span<const Density> density,
                      std::span<const Label> labels, std::span<CoveredVoxel<N>> memory) noexcept
      : grid_(grid), density_(density), labels_(labels), memory_(memory) {}

  template <class Overlap>
  [[nodiscard]] constexpr CoveredVoxels<N> run(const Overlap& overlap,
                                               const SpindleFrame<N>& frame) noexcept {
    DragSums<N> drag;
    for_each_row(grid_, overlap, [&](VoxelIndex first, std::int32_t count, auto&& ratio) {
      const Place start = frame.at(first);
      drag.add(add_row(first, count, ratio, start, frame.step()), start, frame.step());
    });
    found_.drag = drag.mean();
    found_.share_by_weight();
    found_.list = memory_.first(count_);
    return found_;
  }

 private:
  using Covered = typename CoveredVoxel<N>::Covered;

  [[nodiscard]] constexpr Label material_at(std::size_t at) const noexcept {
    if (labels_.empty()) return 0;
    return std::min(labels_[at], static_cast<Label>(kMaxCutMaterials - 1));
  }

  // What a row needs is in locals, which stay in registers while the list is written.
  template <class Ratio>
  constexpr typename DragSums<N>::Row add_row(VoxelIndex first, std::int32_t count, Ratio ratio,
                                              Place place, Place step) noexcept {
    const std::size_t row = grid_.index(first.x, first.y, first.z);
    const std::span<const Density> density = density_;
    CoveredVoxel<N>* voxel = memory_.data() + count_;
    const CoveredVoxel<N>* const end = memory_.data() + memory_.size();
    typename DragSums<N>::Row sums;
    CutWeight<N> settled{};
    Label material = 0;
    for (std::int32_t i = 0; i < count; ++i, place = place + step) {
      const auto r = ratio(i);
      if (!(r > 0)) continue;  // a row may begin before the volume, where there is no ratio
      const std::size_t at = row + static_cast<std::size_t>(i);
      const Density rho = density[at];
      if (rho == 0 || voxel == end) continue;
      const Label here = material_at(at);
      if (here != material) {
        found_.weight[material] += sums.weight - settled;
        settled = sums.weight;
        material = here;
      }
      const auto speed = SpindleFrame<N>::speed(place);
      const Covered covered = static_cast<Covered>(rho) * static_cast<Covered>(r);
      const Covered weight = weight_of<N>(covered, speed);
      sums.covered += covered;
      sums.covered_number += covered * static_cast<CutWeight<N>>(i);
      sums.weight += weight;
      sums.weight_speed += weight * static_cast<CutWeight<N>>(speed);
      voxel->at = static_cast<std::uint32_t>(at);
      voxel->place = {static_cast<std::int16_t>(first.x + i), static_cast<std::int16_t>(first.y),
                      static_cast<std::int16_t>(first.z)};
      voxel->material = here;
      voxel->speed = speed;
      voxel->covered = covered;
      voxel->weight = weight;
      ++voxel;
    }
    found_.weight[material] += sums.weight - settled;
    count_ = static_cast<std::size_t>(voxel - memory_.data());
    return sums;
  }

  const VoxelGrid& grid_;
  std::span<const Density> density_;
  std::span<const Label> labels_;
  std::span<CoveredVoxel<N>> memory_;
  std::size_t count_ = 0;
  CoveredVoxels<N> found_;
};

}  // namespace detail

/// Voxels with density under the tool, as many as `memory` holds. `overlap` is a `BoxOverlap` or an
/// `OverlapBox<N>`, `labels` one per voxel or empty. Servo thread; no heap.
template <class N, class Overlap>
[[nodiscard]] constexpr CoveredVoxels<N> covered_voxels(
    const VoxelGrid& grid, std::span<const Density> density, std::span<const Label> labels,
    const Overlap& overlap, const SpindleFrame<N>& frame,
    std::span<CoveredVoxel<N>> memory) noexcept {
  return detail::CoverScan<N>(grid, density, labels, memory).run(overlap, frame);
}

}  // namespace kerf
