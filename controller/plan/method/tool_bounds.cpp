// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/method/tool_bounds.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <numbers>
#include <span>
#include <tuple>

#include "controller/kernel/kernel_set.hpp"
#include "controller/plan/method/lattice.hpp"
#include "shared/numeric/elementary.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {
namespace {

constexpr double kRightAngle = std::numbers::pi / 2;

/// Cells along one axis: with floors at both ends, a span of E voxels may reach one cell more than
/// E + 1.
std::int32_t cells_of(double span_vox) {
  constexpr double kRounding = 1e-6;  // of the span, which must not lose a cell
  return static_cast<std::int32_t>(std::floor(span_vox + kRounding)) + 2;
}

/// E for each angle between the axes of tool and box, in pitches.
class Spans {
 public:
  explicit Spans(std::span<const ToolOffset> offsets) {
    std::map<double, double> rings;  // radius by height
    double widest = 0;
    for (const ToolOffset& offset : offsets) {  // half pitches
      double& radius = rings[offset[1] / 2.0];
      radius = std::max(radius, hypotenuse(offset[0] / 2.0, offset[2] / 2.0));
      widest = std::max(widest, radius);
    }
    if (rings.empty()) return;
    diameter_ = hypotenuse(rings.rbegin()->first - rings.begin()->first, 2 * widest);
    for (std::size_t i = 0; i < by_angle_.size(); ++i) {
      const auto [along, across] = on_circle(static_cast<double>(i) * kStep);
      double up = -1e9, down = -1e9;
      for (const auto& [height, radius] : rings) {
        up = std::max(up, height * along + radius * across);
        down = std::max(down, -height * along + radius * across);
      }
      by_angle_[i] = up + down;
      if (i < kAngles) least_cosine_[i] = cosine((static_cast<double>(i) + 0.5) * kStep);
    }
  }

  /// Largest E for all angles within `slack` of the one with this cosine, 0..1.
  [[nodiscard]] double most(double cosine, double slack) const {
    const auto nearest = std::ranges::lower_bound(least_cosine_, cosine, std::greater{});
    return by_angle_[static_cast<std::size_t>(nearest - least_cosine_.begin())] +
           diameter_ * (slack + kStep / 2);
  }

 private:
  static constexpr std::size_t kAngles = 1024;
  static constexpr double kStep = kRightAngle / kAngles;
  std::array<double, kAngles + 1> by_angle_{};
  std::array<double, kAngles> least_cosine_{};  ///< of the cosines to which angle i is nearest
  double diameter_ = 0;
};

/// The cylinder about the tool's axis that holds its samples, grown by boxes of three of the
/// volume's longest voxel edges; mm. `along_x` is the square of the cosine of its axis to the
/// volume's x axis; the other two are alike. Both functions are symmetric in y and z and
/// concave in the three squares, whose sum is 1, so that no other direction has more.
class GrownHull {
 public:
  GrownHull(const SceneTool& tool, const SceneVolume& volume) {
    double low = 1e9, high = -1e9;  // half pitches
    for (const ToolOffset& offset : tool.offsets) {
      radius_ = std::max(radius_, hypotenuse(double(offset[0]), double(offset[2])));
      low = std::min(low, double(offset[1]));
      high = std::max(high, double(offset[1]));
    }
    radius_ *= tool.pitch_mm / 2;
    length_ = std::max(0.0, high - low) * tool.pitch_mm / 2;
    const auto& h = volume.image.spacing_mm;
    grown_ = 3 * std::max({h[0], h[1], h[2]});
  }

  [[nodiscard]] double volume(double along_x) const {
    const double aside = (1 - along_x) / 2;
    const double shadows = shadow(along_x) + 2 * shadow(aside);
    const double widths = width(along_x) + 2 * width(aside);
    return disc() * length_ + grown_ * (shadows + grown_ * (widths + grown_));
  }
  /// Along x.
  [[nodiscard]] double shadow_area(double along_x) const {
    return shadow(along_x) + grown_ * (2 * width((1 - along_x) / 2) + grown_);
  }

 private:
  [[nodiscard]] double disc() const { return std::numbers::pi * radius_ * radius_; }
  /// Before it is grown, along a direction with this square of the axis' cosine.
  [[nodiscard]] double shadow(double square) const {
    return 2 * radius_ * length_ * std::sqrt(1 - square) + disc() * std::sqrt(square);
  }
  [[nodiscard]] double width(double square) const {
    return length_ * std::sqrt(square) + 2 * radius_ * std::sqrt(1 - square);
  }

  double radius_ = 0, length_ = 0, grown_ = 0;
};

/// Maximum of a concave function between 0 and 1.
template <class Function>
double maximum(Function f) {
  constexpr int kThirds = 60;
  double low = 0, high = 1;
  for (int i = 0; i < kThirds; ++i) {
    const double third = (high - low) / 3;
    if (f(low + third) < f(high - third)) {
      low += third;
    } else {
      high -= third;
    }
  }
  return f((low + high) / 2);
}

/// Voxels of the volume along each axis that a tool reaches whose samples lie in so many cells.
VoxelGrid reached(const VoxelIndex& cells, const VoxelGrid& grid) {
  return {std::min(cells.x + 1, grid.nx), std::min(cells.y + 1, grid.ny),
          std::min(cells.z + 1, grid.nz)};
}

/// Visits the bits of covered voxels for each row of the overlap, word by word.
template <class Visit>
void each_covered_word(const AlignedTable& table, Visit&& visit) {
  const std::int32_t words = table.row_lanes / 32;
  const std::int32_t row = 2 * words;
  const std::int32_t plane = row * (table.size.y + 2);
  for (std::int32_t z = 0; z <= table.size.z; ++z) {
    for (std::int32_t y = 0; y <= table.size.y; ++y) {
      const std::uint32_t* const corner = table.mask + z * plane + y * row;
      for (std::int32_t word = 0; word < words; ++word) {
        std::uint32_t any = 0;
        for (const std::int32_t at : {0, row, plane, plane + row}) {
          any |= corner[at + word] | corner[at + words + word];
        }
        visit(word, any);
      }
    }
  }
}

}  // namespace

std::vector<VoxelIndex> box_sizes(const SceneTool& tool, const SceneVolume& volume) {
  if (tool.round || !tool.turns) {
    const Matrix steps = unturned_steps(tool, volume);
    std::array<double, 3> edge{};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) edge[i] += std::abs(steps[i][j]) * (tool.size_vox[j] - 1);
    }
    return {{cells_of(edge[0]), cells_of(edge[1]), cells_of(edge[2])}};
  }
  constexpr int kDirections = 96;  // along each angle of one octant; the others are alike
  constexpr double kStep = kRightAngle / kDirections;
  const double slack = kStep * std::numbers::sqrt2 / 2;
  std::array<CirclePoint, kDirections> circle;
  for (int i = 0; i < kDirections; ++i) circle[std::size_t(i)] = on_circle((i + 0.5) * kStep);
  const Spans spans(tool.offsets);
  const auto cells = [&](std::size_t axis, double cosine) {
    return cells_of(spans.most(cosine, slack) * tool.pitch_mm / volume.image.spacing_mm[axis]);
  };
  std::vector<VoxelIndex> sizes;
  for (const auto& [up, out] : circle) {
    const std::int32_t high = cells(2, up);
    for (const auto& [right, back] : circle) {
      const VoxelIndex size{cells(0, out * right), cells(1, out * back), high};
      if (sizes.empty() || !(sizes.back() == size)) sizes.push_back(size);
    }
  }
  const auto key = [](const VoxelIndex& v) { return std::tuple(v.x, v.y, v.z); };
  std::ranges::sort(sizes, {}, key);
  sizes.erase(std::unique(sizes.begin(), sizes.end()), sizes.end());
  return sizes;
}

std::size_t max_covered_voxels(const SceneTool& tool, const SceneVolume& volume) {
  std::size_t by_box = 0;
  for (const VoxelIndex& size : box_sizes(tool, volume)) {
    by_box = std::max(by_box, reached(size, volume.image.grid).voxel_count());
  }
  const auto& h = volume.image.spacing_mm;
  const double by_hull = GrownHull(tool, volume).volume(1.0 / 3) / (h[0] * h[1] * h[2]);
  return std::min(by_box, static_cast<std::size_t>(by_hull));
}

std::size_t max_cover_groups(const SceneTool& tool, const SceneVolume& volume) {
  std::size_t by_box = 0;
  for (const VoxelIndex& size : box_sizes(tool, volume)) {
    VoxelGrid groups = reached(size, volume.image.grid);
    groups.nx = (groups.nx + kCoverGroup - 1) / kCoverGroup;
    by_box = std::max(by_box, groups.voxel_count());
  }
  constexpr double kGroup = kCoverGroup;
  const auto& h = volume.image.spacing_mm;
  const GrownHull hull(tool, volume);
  const double by_rows = maximum([&](double along_x) {
    const double rows = hull.shadow_area(along_x) / (h[1] * h[2]);
    const double voxels = hull.volume(along_x) / (h[0] * h[1] * h[2]);
    return (rows * (kGroup - 1) + voxels) / kGroup;
  });
  return std::min(by_box, static_cast<std::size_t>(by_rows));
}

std::size_t max_cover_groups(const AlignedTable& table) {
  constexpr std::int32_t kFirst = 2;  // lane of the first voxel
  const std::int32_t last_begin = table.size.x + 1 - kCoverGroup;
  std::size_t groups = 0;
  std::int32_t next = 0;  // voxel of the row behind the group that was counted last
  each_covered_word(table, [&](std::int32_t word, std::uint32_t bits) {
    if (word == 0) next = 0;
    for (; bits != 0; bits &= bits - 1) {
      const std::int32_t voxel = 32 * word + std::countr_zero(bits) - kFirst;
      if (voxel < next) continue;
      ++groups;
      const std::int32_t lane = voxel - (voxel - next) % kCoverGroup;  // after whole groups of air
      next = std::min(voxel, std::max(lane, last_begin)) + kCoverGroup;
    }
  });
  return groups;
}

}  // namespace kerf
