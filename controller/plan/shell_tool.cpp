// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/shell_tool.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "controller/plan/lever_of.hpp"

namespace kerf {
namespace {

using Point = std::array<double, 3>;

constexpr std::size_t kGroup = kShellGroup;

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

/// Sorts so that each kGroup lies together: halves across the widest axis until none is larger.
void group_together(std::span<Point> points) {
  if (points.size() <= kGroup) return;
  const Bounds b = bounds_of(points);
  std::size_t widest = 0;
  for (std::size_t axis = 1; axis < 3; ++axis) {
    if (b.high[axis] - b.low[axis] > b.high[widest] - b.low[widest]) widest = axis;
  }
  const std::size_t groups = (points.size() + kGroup - 1) / kGroup, half = groups / 2 * kGroup;
  std::nth_element(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(half), points.end(),
                   [widest](const Point& p, const Point& q) { return p[widest] < q[widest]; });
  group_together(points.first(half));
  group_together(points.subspan(half));
}

double distance(const Point& a, const Point& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

double reach_of(std::span<const Point> samples, std::span<const Point> close) {
  double reach = 0;
  for (const auto& points : {samples, close}) {
    for (const Point& p : points) reach = std::max(reach, distance(p, {}));
  }
  return reach;
}

}  // namespace

template <class N>
ShellTool<N>::ShellTool(std::span<const Point> samples_units, bool round,
                        std::span<const Point> close_units)
    : count_(samples_units.size()),
      reach_(reach_of(samples_units, close_units)),
      round_(round),
      close_(close_units, reach_) {
  assert(!samples_units.empty() && samples_units.size() <= kMaxShellSamples);
  std::vector<Point> points(samples_units.begin(), samples_units.end());
  group_together(points);
  const auto add = [this](auto& to, const Point& p) {
    for (std::size_t axis = 0; axis < 3; ++axis) to[axis].push_back(lever_of<N>(p[axis] / reach_));
  };
  for (const Point& p : points) add(lever_, p);
  while (lever_[0].size() % kGroup != 0) add(lever_, {});
  for (std::size_t first = 0; first < count_; first += kGroup) {
    const std::span<const Point> group(points.data() + first, std::min(kGroup, count_ - first));
    const Bounds b = bounds_of(group);
    Point middle{};
    for (std::size_t axis = 0; axis < 3; ++axis) middle[axis] = (b.low[axis] + b.high[axis]) / 2;
    const double out = distance(middle, {});
    // No lever is beyond the reach: 31 bits would not hold its place.
    for (double& part : middle) part *= reach_ / std::max(out, reach_);
    double radius = 0;
    for (const Point& p : group) radius = std::max(radius, distance(p, middle));
    add(middle_, middle);
    bricks_.push_back(static_cast<std::uint8_t>(free_bricks_for(radius + rounding())));
  }
}

template <class N>
Shell<N> ShellTool<N>::shell() const noexcept {
  Shell<N> shell;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    shell.table.lever[axis] = lever_[axis].data();
    shell.table.middle[axis] = middle_[axis].data();
  }
  shell.table.bricks = bricks_.data();
  shell.table.count = static_cast<std::int32_t>(count_);
  shell.table.groups = static_cast<std::int32_t>(bricks_.size());
  shell.table.round = round_;
  shell.close = close_.table();
  shell.reach = typename N::Real(reach_);
  // No voxel's edge is shorter than a unit; a little for roundings.
  const double longest = reach_ + rounding();
  shell.table.reach =
      static_cast<ShellNumber<N>>(N::kIsFixed ? std::ceil(longest * 65536) : longest);
  shell.step_bits = 16;
  while (std::ldexp(reach_, shell.step_bits) > 65000) --shell.step_bits;
  return shell;
}

template <class N>
std::size_t ShellTool<N>::bytes() const noexcept {
  return 3 * (lever_[0].size() + middle_[0].size()) * sizeof(ShellNumber<N>) + bricks_.size() +
         close_.bytes();
}

template <class N>
void ShellMemory<N>::hold(const Shell<N>& shell) {
  const auto groups = static_cast<std::size_t>(shell.table.groups);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    offset_[axis].resize(std::max(offset_[axis].size(), groups * kGroup));
    middle_[axis].resize(std::max(middle_[axis].size(), groups));
  }
}

template <class N>
ShellPlaces<N> ShellMemory<N>::places() noexcept {
  return {{offset_[0].data(), offset_[1].data(), offset_[2].data()},
          {middle_[0].data(), middle_[1].data(), middle_[2].data()}};
}

template <class N>
std::size_t ShellMemory<N>::bytes() const noexcept {
  return 3 * (offset_[0].size() + middle_[0].size()) * sizeof(ShellNumber<N>);
}

template class ShellTool<FixedNumbers>;
template class ShellTool<FloatNumbers>;
template class ShellTool<DoubleNumbers>;
template class ShellMemory<FixedNumbers>;
template class ShellMemory<FloatNumbers>;
template class ShellMemory<DoubleNumbers>;

}  // namespace kerf
