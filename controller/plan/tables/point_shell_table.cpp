// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/tables/point_shell_table.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "shared/numeric/elementary.hpp"
#include "shared/numeric/linear_algebra.hpp"

namespace kerf {
namespace {

using Point = vec3::Vec;

constexpr std::size_t kGroup = kPointGroup;

struct Bounds {
  Point low, high;
};

Bounds bounds_of(std::span<const Point> points) {
  Bounds b{points.front(), points.front()};
  for (const Point& p : points) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      b.low[axis] = std::min(b.low[axis], p[axis]);
      b.high[axis] = std::max(b.high[axis], p[axis]);
    }
  }
  return b;
}

/// Sorts into compact groups of kGroup: halves across the widest axis until none is larger.
void group_together(std::span<Point> points) {
  if (points.size() <= kGroup) return;
  const Bounds b = bounds_of(points);
  std::size_t widest = 0;
  for (std::size_t axis = 1; axis < 3; ++axis) {
    if (b.high[axis] - b.low[axis] > b.high[widest] - b.low[widest]) widest = axis;
  }
  const std::size_t groups = (points.size() + kGroup - 1) / kGroup, half = groups / 2 * kGroup;
  // A total order: standard libraries part equal points in different ways, and that ends in the
  // bits.
  std::stable_sort(points.begin(), points.end(), [widest](const Point& p, const Point& q) {
    return p[widest] != q[widest] ? p[widest] < q[widest] : p < q;
  });
  group_together(points.first(half));
  group_together(points.subspan(half));
}

double distance(const Point& a, const Point& b) {
  return hypotenuse(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

double reach_of(std::span<const Point> samples, std::span<const SurfaceSample> close) {
  double reach = 0;
  for (const Point& p : samples) reach = std::max(reach, distance(p, {}));
  for (const SurfaceSample& sample : close) reach = std::max(reach, distance(sample.at, {}));
  return reach;
}

}  // namespace

template <class N>
DenseSamples<N>::DenseSamples(std::span<const SurfaceSample> samples_units, double reach) {
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
    std::size_t cell = 0;
    for (const std::size_t axis : {2UL, 1UL, 0UL}) {
      cell = cell * static_cast<std::size_t>(cells_[axis]) +
             static_cast<std::size_t>(cell_of(offset, axis));
    }
    cells[cell].push_back(sample);
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
  for (std::size_t axis = 0; axis < 3; ++axis) {  // up to half of it is not used
    offset_[axis].shrink_to_fit();
    normal_[axis].shrink_to_fit();
  }
}

template <class N>
CloseTable<N> DenseSamples<N>::table() const noexcept {
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
std::size_t DenseSamples<N>::bytes() const noexcept {
  return 6 * offset_[0].size() * sizeof(PointNumber<N>) + first_.size() * sizeof(std::int32_t);
}

template <class N>
PointShellTable<N>::PointShellTable(std::span<const Point> samples_units, bool round,
                                    std::span<const SurfaceSample> close_units,
                                    double deficit_units)
    : count_(samples_units.size()),
      reach_(reach_of(samples_units, close_units)),
      deficit_(deficit_units),
      round_(round),
      close_(close_units, reach_) {
  assert(!samples_units.empty() && samples_units.size() <= kMaxShellPoints);
  std::vector<Point> points(samples_units.begin(), samples_units.end());
  group_together(points);
  const auto add = [this](auto& to, const Point& p) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      to[axis].push_back(sample_offset<N>(p[axis] / reach_));
  };
  for (const Point& p : points) add(offset_, p);
  while (offset_[0].size() % kGroup != 0) add(offset_, {});
  for (std::size_t first = 0; first < count_; first += kGroup) {
    const std::span<const Point> group(points.data() + first, std::min(kGroup, count_ - first));
    const Bounds b = bounds_of(group);
    Point middle{};
    for (std::size_t axis = 0; axis < 3; ++axis) middle[axis] = (b.low[axis] + b.high[axis]) / 2;
    const double out = distance(middle, {});
    // No offset may be beyond the reach: 31 bits would not hold its position.
    for (double& part : middle) part *= reach_ / std::max(out, reach_);
    double radius = 0;
    for (const Point& p : group) radius = std::max(radius, distance(p, middle));
    add(middle_, middle);
    needed_.push_back(free_steps_for(radius + rounding()));
  }
}

template <class N>
PointShell<N> PointShellTable<N>::point_shell() const noexcept {
  PointShell<N> point_shell;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    point_shell.table.offset[axis] = offset_[axis].data();
    point_shell.table.middle[axis] = middle_[axis].data();
  }
  point_shell.table.needed = needed_.data();
  point_shell.table.needed_whole = free_steps_for(reach_ + rounding());
  point_shell.table.needed_sample = free_steps_for(rounding());
  point_shell.table.count = static_cast<std::int32_t>(count_);
  point_shell.table.groups = static_cast<std::int32_t>(needed_.size());
  point_shell.table.round = round_;
  point_shell.close = close_.table();
  point_shell.reach = typename N::Real(reach_);
  point_shell.deficit = typename N::Real(deficit_);
  // No voxel's edge is shorter than a unit; a little for roundings.
  const double longest = reach_ + rounding();
  point_shell.table.reach =
      static_cast<PointNumber<N>>(N::kIsFixed ? std::ceil(longest * 65536) : longest);
  point_shell.step_bits = 16;
  while (std::ldexp(reach_, point_shell.step_bits) > 65000) --point_shell.step_bits;
  return point_shell;
}

template <class N>
std::size_t PointShellTable<N>::bytes() const noexcept {
  return 3 * (offset_[0].size() + middle_[0].size()) * sizeof(PointNumber<N>) + needed_.size() +
         close_.bytes();
}

template <class N>
void TransformedShell<N>::hold(const PointShell<N>& point_shell) {
  const auto groups = static_cast<std::size_t>(point_shell.table.groups);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    offset_vox_[axis].resize(std::max(offset_vox_[axis].size(), groups * kGroup));
    middle_[axis].resize(std::max(middle_[axis].size(), groups));
  }
}

template <class N>
PointPositions<N> TransformedShell<N>::places() noexcept {
  return {{offset_vox_[0].data(), offset_vox_[1].data(), offset_vox_[2].data()},
          {middle_[0].data(), middle_[1].data(), middle_[2].data()}};
}

template <class N>
std::size_t TransformedShell<N>::bytes() const noexcept {
  return 3 * (offset_vox_[0].size() + middle_[0].size()) * sizeof(PointNumber<N>);
}

template class DenseSamples<FixedNumbers>;
template class DenseSamples<DoubleNumbers>;
template class PointShellTable<FixedNumbers>;
template class PointShellTable<DoubleNumbers>;
template class TransformedShell<FixedNumbers>;
template class TransformedShell<DoubleNumbers>;

}  // namespace kerf
