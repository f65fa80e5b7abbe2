// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/kernel/point_shell/point_table.hpp"

namespace kerf {

/// A closeup looks at least so far around a contact, units, and up to a cell farther.
inline constexpr double kCloseRadius = 2;
inline constexpr double kCloseCell = 1;          ///< units; edge of the cells of close samples
inline constexpr double kClosePitch = 0.35;      ///< units between them
inline constexpr std::int32_t kMostClose = 256;  ///< that a closeup reads; some 200 on a flat
inline constexpr std::int32_t kMostInCell = 32;

/// A tool's surface in close samples: the rim or the point of a tool on a sharp edge touches in
/// less than the spacing of the point shell's own samples.
///
/// Sorted by cells, x fastest. Made at load (controller/plan/tables/close_cells.hpp); points into
/// the maker's memory. A ball has none.
template <class N>
struct CloseTable {
  const PointNumber<N>* offset[3] = {};  ///< from the tool's centre, over its reach; Q0.15
  const std::int32_t* first = nullptr;   ///< sample of each cell, then the end; null: none
  std::int32_t cells[3] = {};            ///< along the axes
  PointNumber<N> low[3] = {};            ///< offset where the first cell begins
  PointNumber<N> edge{};                 ///< kCloseCell over the reach
};

}  // namespace kerf
