// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/method/covered_bound.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "controller/kernel/cover_table.hpp"
#include "controller/plan/method/turned_box.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {
namespace {

/// The cylinder about the tool's axis that holds its samples, grown by boxes of three of the
/// volume's longest voxel edges; mm. `along_x` is the square of the cosine of its axis to the
/// volume's x axis; the other two are alike. What is asked of it is symmetric in y and z and
/// concave in the three squares, whose sum is 1: for no other direction it is more.
class GrownHull {
 public:
  GrownHull(const SceneTool& tool, const SceneVolume& volume) {
    double low = 1e9, high = -1e9;  // half pitches
    for (const ToolOffset& offset : tool.offsets) {
      radius_ = std::max(radius_, std::hypot(double(offset[0]), double(offset[2])));
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

/// Of a concave function between 0 and 1.
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

/// For each row of the overlap the bits of what is covered, word by word.
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

std::size_t most_covered(const SceneTool& tool, const SceneVolume& volume) {
  std::size_t by_box = 0;
  for (const VoxelIndex& size : box_sizes(tool, volume)) {
    by_box = std::max(by_box, VoxelGrid{size.x + 1, size.y + 1, size.z + 1}.voxel_count());
  }
  const auto& h = volume.image.spacing_mm;
  const double by_hull = GrownHull(tool, volume).volume(1.0 / 3) / (h[0] * h[1] * h[2]);
  return std::min(by_box, static_cast<std::size_t>(by_hull));
}

std::size_t most_groups(const SceneTool& tool, const SceneVolume& volume) {
  std::size_t by_box = 0;
  for (const VoxelIndex& size : box_sizes(tool, volume)) {
    const std::int32_t in_row = size.x / kCoverGroup + 1;
    by_box = std::max(by_box, VoxelGrid{in_row, size.y + 1, size.z + 1}.voxel_count());
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

std::size_t most_groups(const AlignedTable& table) {
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
