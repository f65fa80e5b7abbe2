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

  /// Takes the samples of the cells within kCloseRadius of the offset `around`; of too many,
  /// kMostClose spread evenly.
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
      from[axis] = std::max(0, at[axis] / kFine - kCloseRadius);
      to[axis] = std::min(at[axis] / kFine + kCloseRadius + 1, table.cells[axis]);
    }
    const auto square_to = [&](std::size_t axis, std::int32_t cell) {  // of the distance to a cell
      const std::int32_t low = kFine * cell;
      const std::int32_t gap = std::max({0, low - at[axis] - 1, at[axis] - low - kFine});
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
  /// The samples in whole groups. What fills up the last group is no sample: `fade`, once all
  /// densities are read, lets it weigh nothing.
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
  [[nodiscard]] constexpr CloseLook<N> fade(const PointTable<N>& table) noexcept {
    std::fill(density.begin() + count, density.begin() + table.count, PointNumber<N>(0));
    CloseLook<N> look{
        .count = table.count, .radius = radius, .density = density.data(), .window = window.data()};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      look.offset[axis] = offset[axis].data();
      look.normal[axis] = normal[axis].data();
      look.middle[axis] = middle[axis];
    }
    return look;
  }
  [[nodiscard]] constexpr PointPlaces<N> places() noexcept {
    return {{offset_vox[0].data(), offset_vox[1].data(), offset_vox[2].data()}, {}};
  }
};

/// What a closeup tells of the peak of density.
template <class N>
struct Closeup {
  typename N::Ratio height{};     ///< 0 where nothing is felt
  typename N::Ratio offset[3]{};  ///< from the tool's centre to the peak, over the reach; its axes
  typename N::Ratio normal[3]{};  ///< of the tool at the peak, outward; its axes, length near 1
  typename N::Ratio spread{};     ///< of the tool's normals there: 1 - (mean normal)^2
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
/// powers 32 and 64, tell e and the summit (docs/theory.md 3.5); where it is, as in peak_offset;
/// and the mean normal with power 16 is the tool's there.
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

}  // namespace kerf
