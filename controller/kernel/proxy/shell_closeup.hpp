// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/proxy/shell_peak.hpp"
#include "controller/kernel/proxy/shell_sums.hpp"
#include "controller/kernel/proxy/shell_table.hpp"

namespace kerf {

/// A closeup sees at least so far around a contact, and samples up to half a unit farther.
inline constexpr double kCloseRadius = 2;
inline constexpr double kCloseCell = 1;          ///< units; edge of the cells of close samples
inline constexpr double kClosePitch = 0.35;      ///< units between them
inline constexpr std::int32_t kMostClose = 256;  ///< that a closeup reads; some 200 on a flat
inline constexpr std::int32_t kMostInCell = 32;

/// A tool's surface in samples that lie close together: the rim or the point of a tool on a sharp
/// edge touches in less than the distance of the shell's own samples.
///
/// Sorted by cells, along x first. Made at load (controller/scene/close_cells.hpp) and points into
/// the maker's memory. A ball has none.
template <class N>
struct CloseTable {
  const ShellNumber<N>* lever[3] = {};  ///< from the tool's centre, over its reach; Q0.15
  const std::int32_t* first = nullptr;  ///< sample of each cell, then the end of the last; or none
  std::int32_t cells[3] = {};           ///< along the axes
  ShellNumber<N> low[3] = {};           ///< lever at which the first cell begins
  ShellNumber<N> edge{};                ///< kCloseCell over the reach
};

/// The close samples around a contact: their levers, places and densities, as whole vectors.
template <class N>
struct CloseSamples {
  using Array = std::array<ShellNumber<N>, kMostClose>;
  static_assert(kMostClose % kShellGroup == 0);

  std::array<Array, 3> lever, offset;
  Array density;
  std::int32_t count = 0;

  /// Those of the cells around `middle`, a lever; the first kMostClose of more.
  constexpr void take(const CloseTable<N>& table, const ShellNumber<N> (&middle)[3]) noexcept {
    constexpr auto kReach = static_cast<std::int32_t>(kCloseRadius / kCloseCell);
    using Number = ShellNumber<N>;
    std::int32_t from[3] = {}, to[3] = {};  // cells
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Number way = std::max(Number(0), middle[axis] - table.low[axis]);
      const std::int32_t cell =
          std::min(static_cast<std::int32_t>(way / table.edge), table.cells[axis]);
      from[axis] = std::max(0, cell - kReach);
      to[axis] = std::min(cell + kReach + 1, table.cells[axis]);
    }
    count = 0;
    for (std::int32_t z = from[2]; z < to[2]; ++z) {
      for (std::int32_t y = from[1]; y < to[1]; ++y) {
        const std::int32_t row = (z * table.cells[1] + y) * table.cells[0];
        const std::int32_t first = table.first[row + from[0]];
        const std::int32_t more = std::min(table.first[row + to[0]] - first, kMostClose - count);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          std::copy_n(table.lever[axis] + first, more, lever[axis].data() + count);
        }
        count += more;
      }
    }
  }
  /// Whole vectors of them; what fills the last up is no sample.
  [[nodiscard]] constexpr ShellTable<N> table() noexcept {
    ShellTable<N> table;
    table.count = (count + kShellGroup - 1) / kShellGroup * kShellGroup;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::fill(lever[axis].begin() + count, lever[axis].begin() + table.count, ShellNumber<N>(0));
      table.lever[axis] = lever[axis].data();
    }
    return table;
  }
  [[nodiscard]] constexpr ShellPlaces<N> places() noexcept {
    return {{offset[0].data(), offset[1].data(), offset[2].data()}, {}};
  }
};

/// What a look at a contact tells of its peak of density.
template <class N>
struct Closeup {
  typename N::Ratio height{};
  typename N::Ratio lever[3]{};  ///< from the tool's centre to the peak, over the reach; its axes
  typename N::Ratio top{};       ///< density of the highest sample
};

/// Sums over samples, weighted with a power of t: their density over the highest. Fixed: t and its
/// powers in Q16.
template <class N>
struct PowerSums {
  typename N::Sum weight{}, density{}, lever[3]{};  ///< SUM t^p, SUM t^p t, SUM t^p lever

  constexpr void add(ShellNumber<N> power, ShellNumber<N> t,
                     const ShellNumber<N> (&at)[3]) noexcept {
    using Sum = typename N::Sum;
    weight += power;
    density += Sum(power) * t;
    for (std::size_t axis = 0; axis < 3; ++axis) lever[axis] += Sum(power) * at[axis];
  }
  /// `sum` over the weight; `bits`: from its fraction bits, less those of the weight, to 24.
  [[nodiscard]] constexpr typename N::Ratio mean(typename N::Sum sum,
                                                 [[maybe_unused]] int bits) const noexcept {
    if constexpr (N::kIsFixed) {
      return N::Ratio::from_raw(static_cast<std::int32_t>((sum << bits) / weight));
    } else {
      return sum / weight;
    }
  }
};

/// Where about the peak is: its lever in the tool's axes, from the shell's sums. Beside a rim or a
/// point density falls to one side, and means of places weighted with its powers 6 and 8 are off by
/// shares of 1 / (7 + e) and 1 / (9 + e).
template <class N>
constexpr void peak_lever(const ShellSums<N>& sums, typename N::Ratio e,
                          ShellNumber<N> (&lever)[3]) noexcept {
  using Ratio = typename N::Ratio;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Ratio peak = mean_of<N>(sums.lever[axis], sums.weight, 9);
    if (sums.high > typename N::Sum(0)) {
      const Ratio near = peak;
      peak = mean_of<N>(sums.high_lever[axis], sums.high, 9);
      peak = peak + (peak - near) * ((Ratio(7) + e) / Ratio(2));
    }
    if constexpr (N::kIsFixed) {
      lever[axis] = peak.raw() >> 9;
    } else {
      lever[axis] = peak;
    }
  }
}

/// The peak of density over a tool's surface, from its close samples.
///
/// As in shell_peak.hpp the mean of the height, weighted with its power p, is the summit's times
/// (p + 1) / (p + 1 + e). With p = 32 and 64 two such means tell e and the summit. They also tell
/// where it is, as in peak_lever.
template <class N>
[[nodiscard]] constexpr Closeup<N> peak_among(const CloseSamples<N>& samples) noexcept {
  using Number = ShellNumber<N>;
  using Ratio = typename N::Ratio;
  Closeup<N> found;
  const auto count = static_cast<std::size_t>(samples.count);
  Number top(0);
  for (std::size_t i = 0; i < count; ++i) top = std::max(top, samples.density[i]);
  if (top < kFaintest<N>) return found;
  [[maybe_unused]] const std::int64_t over_top =
      N::kIsFixed ? (std::int64_t{1} << 31) / std::int64_t(top) : 0;
  PowerSums<N> low, high;
  for (std::size_t i = 0; i < count; ++i) {
    const Number density = samples.density[i];
    if (density < top - top / 4) continue;  // 0.75^32 is nothing
    Number t{};
    if constexpr (N::kIsFixed) {
      t = static_cast<Number>(std::int64_t{density} * over_top >> 15);
    } else {
      t = density / top;
    }
    const auto squared = [](Number a) {
      if constexpr (N::kIsFixed) {
        return static_cast<Number>((std::int64_t{a} * a + (1 << 15)) >> 16);
      } else {
        return a * a;
      }
    };
    const Number power = squared(squared(squared(squared(squared(t)))));
    const Number lever[3] = {samples.lever[0][i], samples.lever[1][i], samples.lever[2][i]};
    low.add(power, t, lever);
    high.add(squared(power), t, lever);
  }
  constexpr double kLowOne = 33, kHighOne = 65;  // p + 1
  const Ratio below = low.mean(low.density, 8), above = high.mean(high.density, 8);
  const Ratio e =
      std::clamp(Ratio(kLowOne) * (above - below) / (below - Ratio(kLowOne / kHighOne) * above),
                 Ratio(0), Ratio(2));
  constexpr auto kUnsampled = Ratio(1.02);  // no summit is far above the highest sample
  const Ratio summit = std::min(above + above * (e / Ratio(kHighOne)), kUnsampled);
  if constexpr (N::kIsFixed) {
    found.top = Ratio::from_raw(top << 9);
  } else {
    found.top = top;
  }
  found.height = found.top * summit;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Ratio near = low.mean(low.lever[axis], 9), peak = high.mean(high.lever[axis], 9);
    found.lever[axis] = peak + (peak - near) * ((Ratio(kLowOne) + e) / Ratio(kHighOne - kLowOne));
  }
  return found;
}

}  // namespace kerf
