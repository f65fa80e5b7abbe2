// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/tables/close_cells.hpp"

#include <algorithm>

namespace kerf {

template <class N>
CloseCells<N>::CloseCells(std::span<const std::array<double, 3>> samples_units, double reach) {
  if (samples_units.empty()) return;
  using Offset = std::array<PointNumber<N>, 3>;
  std::vector<Offset> offsets;
  for (const auto& sample : samples_units) {
    offsets.push_back({sample_offset<N>(sample[0] / reach), sample_offset<N>(sample[1] / reach),
                       sample_offset<N>(sample[2] / reach)});
  }
  edge_ = sample_offset<N>(kCloseCell / reach);
  Offset high = low_ = offsets.front();
  for (const Offset& offset : offsets) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low_[axis] = std::min(low_[axis], offset[axis]);
      high[axis] = std::max(high[axis], offset[axis]);
    }
  }
  const auto cell_of = [&](const Offset& offset, std::size_t axis) {
    return static_cast<std::int32_t>((offset[axis] - low_[axis]) / edge_);
  };
  for (std::size_t axis = 0; axis < 3; ++axis) cells_[axis] = cell_of(high, axis) + 1;
  std::vector<std::vector<Offset>> cells(static_cast<std::size_t>(cells_[0]) *
                                         static_cast<std::size_t>(cells_[1]) *
                                         static_cast<std::size_t>(cells_[2]));
  for (const Offset& offset : offsets) {
    const std::int32_t row = cell_of(offset, 2) * cells_[1] + cell_of(offset, 1);
    cells[static_cast<std::size_t>(row * cells_[0] + cell_of(offset, 0))].push_back(offset);
  }
  for (const auto& cell : cells) {
    first_.push_back(static_cast<std::int32_t>(offset_[0].size()));
    const std::size_t kept = std::min<std::size_t>(cell.size(), kMostInCell);
    for (std::size_t k = 0; k < kept; ++k) {
      const Offset& offset = cell[k * cell.size() / kept];
      for (std::size_t axis = 0; axis < 3; ++axis) offset_[axis].push_back(offset[axis]);
    }
  }
  first_.push_back(static_cast<std::int32_t>(offset_[0].size()));
}

template <class N>
CloseTable<N> CloseCells<N>::table() const noexcept {
  CloseTable<N> table;
  if (first_.empty()) return table;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    table.offset[axis] = offset_[axis].data();
    table.cells[axis] = cells_[axis];
    table.low[axis] = low_[axis];
  }
  table.first = first_.data();
  table.edge = edge_;
  return table;
}

template <class N>
std::size_t CloseCells<N>::bytes() const noexcept {
  return 3 * offset_[0].size() * sizeof(PointNumber<N>) + first_.size() * sizeof(std::int32_t);
}

template class CloseCells<FixedNumbers>;
template class CloseCells<FloatNumbers>;
template class CloseCells<DoubleNumbers>;

}  // namespace kerf
