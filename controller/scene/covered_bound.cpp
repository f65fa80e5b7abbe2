// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/covered_bound.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "controller/kernel/cover_table.hpp"
#include "controller/scene/turned_box.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {
namespace {

/// Radius and length of the cylinder about the tool's axis that holds its samples, mm.
struct Hull {
  double radius = 0, length = 0;
};

Hull hull_of(const SceneTool& tool) {
  double radius = 0, low = 1e9, high = -1e9;  // half pitches
  for (const ToolOffset& offset : tool.offsets) {
    radius = std::max(radius, std::hypot(double(offset[0]), double(offset[2])));
    low = std::min(low, double(offset[1]));
    high = std::max(high, double(offset[1]));
  }
  const double half_pitch_mm = tool.pitch_mm / 2;
  return {radius * half_pitch_mm, std::max(0.0, high - low) * half_pitch_mm};
}

double grown_by(const SceneVolume& volume) {
  const auto& h = volume.image.spacing_mm;
  return 3 * std::max({h[0], h[1], h[2]});
}

/// Rows along x that meet the grown hull.
double rows_by_hull(const SceneTool& tool, const SceneVolume& volume) {
  const auto& h = volume.image.spacing_mm;
  const double b = grown_by(volume);
  const auto [radius, length] = hull_of(tool);
  // A shadow is 2 r L sin + pi r^2 cos of the axis' angle to x; of the two widths that it grows by,
  // each is L cos + 2 r sin.
  const double shadow = std::hypot(2 * radius * length, std::numbers::pi * radius * radius);
  const double widths = length * std::numbers::sqrt2 + 2 * 2 * radius;
  return (shadow + b * widths + b * b) / (h[1] * h[2]);
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

std::size_t by_hull(const SceneTool& tool, const SceneVolume& volume) {
  // Sums over three axes of |cos| and of sin of their angles to one direction.
  constexpr double kMostCosines = std::numbers::sqrt3;
  constexpr double kMostSines = std::numbers::sqrt2 * std::numbers::sqrt3;
  const auto& h = volume.image.spacing_mm;
  const double b = grown_by(volume);
  const auto [radius, length] = hull_of(tool);
  const double disc = std::numbers::pi * radius * radius;
  const double shadows = 2 * radius * length * kMostSines + disc * kMostCosines;
  const double widths = length * kMostCosines + 2 * radius * kMostSines;
  const double grown = disc * length + b * shadows + b * b * widths + b * b * b;
  return static_cast<std::size_t>(grown / (h[0] * h[1] * h[2]));
}

}  // namespace

std::size_t most_covered(const SceneTool& tool, const SceneVolume& volume) {
  std::size_t by_box = 0;
  for (const VoxelIndex& size : box_sizes(tool, volume)) {
    by_box = std::max(by_box, VoxelGrid{size.x + 1, size.y + 1, size.z + 1}.voxel_count());
  }
  return std::min(by_box, by_hull(tool, volume));
}

std::size_t most_covered(const AlignedTable& table) {
  std::size_t covered = 0;
  each_covered_word(table, [&](std::int32_t, std::uint32_t bits) {
    covered += static_cast<std::size_t>(std::popcount(bits));
  });
  return covered;
}

std::size_t most_groups(const SceneTool& tool, const SceneVolume& volume) {
  std::size_t by_box = 0;
  for (const VoxelIndex& size : box_sizes(tool, volume)) {
    const std::int32_t in_row = size.x / kCoverGroup + 1;
    by_box = std::max(by_box, VoxelGrid{in_row, size.y + 1, size.z + 1}.voxel_count());
  }
  constexpr double kGroup = kCoverGroup;
  const double by_rows = rows_by_hull(tool, volume) * (kGroup - 1) / kGroup +
                         static_cast<double>(by_hull(tool, volume)) / kGroup;
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
