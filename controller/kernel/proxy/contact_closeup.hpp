// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/point_shell/close_sums.hpp"
#include "controller/kernel/point_shell/point_sums.hpp"
#include "controller/kernel/point_shell/point_table.hpp"
#include "controller/kernel/proxy/contact_peak.hpp"

namespace kerf {

/// A tool that is no ball gets a closer look at its contact while it is at most so deep, or so
/// high. At an edge the point shell's own samples find the tool up to 0.4 units higher than it is.
inline constexpr double kCloseDepth = 0.4;  ///< units

/// The close samples around a contact: offsets in the tool's axes and in voxels, and densities.
template <class N>
struct CloseSamples {
  using Array = std::array<PointNumber<N>, kMostClose>;
  static_assert(kMostClose % kPointGroup == 0);

  std::array<Array, 3> offset, offset_vox;
  Array density;
  std::int32_t count = 0;

  /// Takes the samples of the cells around the offset `middle`; of too many, kMostClose spread
  /// evenly.
  constexpr void take(const CloseTable<N>& table, const PointNumber<N> (&middle)[3]) noexcept {
    constexpr auto kReach = static_cast<std::int32_t>(kCloseRadius / kCloseCell);
    using Number = PointNumber<N>;
    std::int32_t from[3] = {}, to[3] = {};  // cells
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Number from_low = std::max(Number(0), middle[axis] - table.low[axis]);
      const std::int32_t cell =
          std::min(static_cast<std::int32_t>(from_low / table.edge), table.cells[axis]);
      from[axis] = std::max(0, cell - kReach);
      to[axis] = std::min(cell + kReach + 1, table.cells[axis]);
    }
    const auto each_row = [&](auto&& visit) {  // of cells: its first sample, and the end
      for (std::int32_t z = from[2]; z < to[2]; ++z) {
        for (std::int32_t y = from[1]; y < to[1]; ++y) {
          const std::int32_t row = (z * table.cells[1] + y) * table.cells[0];
          visit(table.first[row + from[0]], table.first[row + to[0]]);
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
        }
        count += more;
        return;
      }
      for (; count < kMostClose; ++count) {
        const std::int32_t at = count * all / kMostClose - seen;
        if (at >= more) break;
        const auto slot = static_cast<std::size_t>(count);
        for (std::size_t axis = 0; axis < 3; ++axis)
          offset[axis][slot] = table.offset[axis][first + at];
      }
      seen += more;
    });
  }
  /// The samples in whole groups. What fills up the last group is no sample: call `fade` once all
  /// densities are read.
  [[nodiscard]] constexpr PointTable<N> table() noexcept {
    PointTable<N> table;
    table.count = (count + kPointGroup - 1) / kPointGroup * kPointGroup;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::fill(offset[axis].begin() + count, offset[axis].begin() + table.count,
                PointNumber<N>(0));
      table.offset[axis] = offset[axis].data();
    }
    return table;
  }
  constexpr void fade(const PointTable<N>& table) noexcept {
    std::fill(density.begin() + count, density.begin() + table.count, PointNumber<N>(0));
  }
  [[nodiscard]] constexpr PointPlaces<N> places() noexcept {
    return {{offset_vox[0].data(), offset_vox[1].data(), offset_vox[2].data()}, {}};
  }
};

/// What a closeup tells of the peak of density.
template <class N>
struct Closeup {
  typename N::Ratio height{};
  typename N::Ratio offset[3]{};  ///< from the tool's centre to the peak, over the reach; its axes
  typename N::Ratio top{};        ///< density of the highest sample
};

/// Roughly where the peak is, as an offset in the tool's axes, from the point shell's sums. Beside
/// a rim or a point density falls to one side only, so the mean places with powers 6 and 8 are off
/// by shares of 1 / (7 + e) and 1 / (9 + e); the two extrapolate to the peak (docs/theory.md 3.5).
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
/// powers 32 and 64, tell e and the summit (docs/theory.md 3.5); and where it is, as in
/// peak_offset.
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
  constexpr auto kUnsampled = Ratio(1.02);  // no summit is far above the highest sample
  const Ratio summit = std::min(above + above * (e / Ratio(kHighOne)), kUnsampled);
  if constexpr (N::kIsFixed) {
    found.top = Ratio::from_raw(sums.top << 9);
  } else {
    found.top = sums.top;
  }
  found.height = found.top * summit;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Ratio near = mean(sums.low, sums.low.offset[axis]),
                peak = mean(sums.high, sums.high.offset[axis]);
    found.offset[axis] = peak + (peak - near) * ((Ratio(kLowOne) + e) / Ratio(kHighOne - kLowOne));
  }
  return found;
}

}  // namespace kerf
