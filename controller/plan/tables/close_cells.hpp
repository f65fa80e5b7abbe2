// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "controller/kernel/point_shell/point_table.hpp"
#include "controller/tool/surface_sample.hpp"

namespace kerf {

/// An offset over the tool's reach, as PointTable holds it; fixed: Q0.15.
template <class N>
[[nodiscard]] PointNumber<N> sample_offset(double share) {
  if constexpr (N::kIsFixed) {
    return static_cast<PointNumber<N>>(std::lround(share * 32768));
  } else {
    return static_cast<PointNumber<N>>(share);
  }
}

/// Owner of a tool's close samples, sorted by cells. Load time; moving it keeps the table valid. In
/// FixedNumbers, FloatNumbers and DoubleNumbers.
template <class N>
class CloseCells {
 public:
  /// `samples_units`: from the tool's centre, none farther than `reach`; contact units. Of a cell
  /// with more than kMostInCell, so many stay, evenly chosen. Without samples there is no table.
  CloseCells(std::span<const SurfaceSample> samples_units, double reach);

  [[nodiscard]] CloseTable<N> table() const noexcept;
  [[nodiscard]] std::size_t bytes() const noexcept;

 private:
  std::array<std::vector<PointNumber<N>>, 3> offset_, normal_;
  std::vector<std::int32_t> first_;
  std::array<std::int32_t, 3> cells_{};
  std::array<PointNumber<N>, 3> low_{};
  PointNumber<N> edge_{};
};

}  // namespace kerf
