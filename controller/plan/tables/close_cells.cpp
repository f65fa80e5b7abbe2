// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/tables/close_cells.hpp"

#include <algorithm>

namespace kerf {

template <class N>
CloseCells<N>::CloseCells(std::span<const SurfaceSample> samples_units, double reach) {
  if (samples_units.empty()) return;
  using Vector = std::array<PointNumber<N>, 3>;
  struct Close {
    Vector offset, normal;
  };
  std::vector<Close> samples;
  for (const SurfaceSample& sample : samples_units) {
    Close close;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      close.offset[axis] = sample_offset<N>(sample.at[axis] / reach);
      close.normal[axis] = sample_offset<N>(sample.normal[axis]);
    }
    samples.push_back(close);
  }
  edge_ = sample_offset<N>(1 / reach);
  Vector high = low_ = samples.front().offset;
  for (const Close& sample : samples) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low_[axis] = std::min(low_[axis], sample.offset[axis]);
      high[axis] = std::max(high[axis], sample.offset[axis]);
    }
  }
  const auto cell_of = [&](const Vector& offset, std::size_t axis) {
    return static_cast<std::int32_t>((offset[axis] - low_[axis]) / edge_);
  };
  for (std::size_t axis = 0; axis < 3; ++axis) cells_[axis] = cell_of(high, axis) + 1;
  std::vector<std::vector<Close>> cells(static_cast<std::size_t>(cells_[0]) *
                                        static_cast<std::size_t>(cells_[1]) *
                                        static_cast<std::size_t>(cells_[2]));
  for (const Close& sample : samples) {
    const Vector& offset = sample.offset;
    const std::int32_t row = cell_of(offset, 2) * cells_[1] + cell_of(offset, 1);
    cells[static_cast<std::size_t>(row * cells_[0] + cell_of(offset, 0))].push_back(sample);
  }
  for (const auto& cell : cells) {
    first_.push_back(static_cast<std::int32_t>(offset_[0].size()));
    const std::size_t kept = std::min<std::size_t>(cell.size(), kMostInCell);
    for (std::size_t k = 0; k < kept; ++k) {
      const Close& sample = cell[k * cell.size() / kept];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        offset_[axis].push_back(sample.offset[axis]);
        normal_[axis].push_back(sample.normal[axis]);
      }
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
    table.normal[axis] = normal_[axis].data();
    table.cells[axis] = cells_[axis];
    table.low[axis] = low_[axis];
  }
  table.first = first_.data();
  table.edge = edge_;
  return table;
}

template <class N>
std::size_t CloseCells<N>::bytes() const noexcept {
  return 6 * offset_[0].size() * sizeof(PointNumber<N>) + first_.size() * sizeof(std::int32_t);
}

template class CloseCells<FixedNumbers>;
template class CloseCells<FloatNumbers>;
template class CloseCells<DoubleNumbers>;

}  // namespace kerf
