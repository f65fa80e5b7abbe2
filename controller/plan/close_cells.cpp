// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/close_cells.hpp"

#include <algorithm>

#include "controller/plan/lever_of.hpp"

namespace kerf {

template <class N>
CloseCells<N>::CloseCells(std::span<const std::array<double, 3>> samples_units, double reach) {
  if (samples_units.empty()) return;
  using Lever = std::array<ShellNumber<N>, 3>;
  std::vector<Lever> levers;
  for (const auto& sample : samples_units) {
    levers.push_back({lever_of<N>(sample[0] / reach), lever_of<N>(sample[1] / reach),
                      lever_of<N>(sample[2] / reach)});
  }
  edge_ = lever_of<N>(kCloseCell / reach);
  Lever high = low_ = levers.front();
  for (const Lever& lever : levers) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low_[axis] = std::min(low_[axis], lever[axis]);
      high[axis] = std::max(high[axis], lever[axis]);
    }
  }
  const auto cell_of = [&](const Lever& lever, std::size_t axis) {
    return static_cast<std::int32_t>((lever[axis] - low_[axis]) / edge_);
  };
  for (std::size_t axis = 0; axis < 3; ++axis) cells_[axis] = cell_of(high, axis) + 1;
  std::vector<std::vector<Lever>> cells(static_cast<std::size_t>(cells_[0]) *
                                        static_cast<std::size_t>(cells_[1]) *
                                        static_cast<std::size_t>(cells_[2]));
  for (const Lever& lever : levers) {
    const std::int32_t row = cell_of(lever, 2) * cells_[1] + cell_of(lever, 1);
    cells[static_cast<std::size_t>(row * cells_[0] + cell_of(lever, 0))].push_back(lever);
  }
  for (const auto& cell : cells) {
    first_.push_back(static_cast<std::int32_t>(lever_[0].size()));
    const std::size_t kept = std::min<std::size_t>(cell.size(), kMostInCell);
    for (std::size_t k = 0; k < kept; ++k) {
      const Lever& lever = cell[k * cell.size() / kept];
      for (std::size_t axis = 0; axis < 3; ++axis) lever_[axis].push_back(lever[axis]);
    }
  }
  first_.push_back(static_cast<std::int32_t>(lever_[0].size()));
}

template <class N>
CloseTable<N> CloseCells<N>::table() const noexcept {
  CloseTable<N> table;
  if (first_.empty()) return table;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    table.lever[axis] = lever_[axis].data();
    table.cells[axis] = cells_[axis];
    table.low[axis] = low_[axis];
  }
  table.first = first_.data();
  table.edge = edge_;
  return table;
}

template <class N>
std::size_t CloseCells<N>::bytes() const noexcept {
  return 3 * lever_[0].size() * sizeof(ShellNumber<N>) + first_.size() * sizeof(std::int32_t);
}

template class CloseCells<FixedNumbers>;
template class CloseCells<FloatNumbers>;
template class CloseCells<DoubleNumbers>;

}  // namespace kerf
