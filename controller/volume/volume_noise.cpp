// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/volume_noise.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

namespace kerf {
namespace {

// The weights of [1 -2 1] along three axes: their squares sum to 6^3, their magnitudes to 4^3.
constexpr double kGain = 14.696938456699069;                // sqrt(216), of white noise
constexpr double kMedian = 0.67448975019608171;             // of |x|, x normal with deviation 1
constexpr std::size_t kMostLeft = std::size_t{32} * 65535;  // half of the magnitudes are positive

/// How often each value occurs, and which one is in the middle.
class ValueCounts {
 public:
  explicit ValueCounts(std::size_t values) : counts_(values) {}

  void add(std::size_t value) {
    ++counts_[value];
    ++total_;
  }
  [[nodiscard]] std::size_t total() const { return total_; }
  /// 0 where nothing was added.
  [[nodiscard]] std::size_t median() const {
    std::size_t value = 0;
    for (std::size_t below = counts_[0]; 2 * below < total_; below += counts_[value]) ++value;
    return value;
  }

 private:
  std::vector<std::uint32_t> counts_;  // there are at most 2^29 voxels
  std::size_t total_ = 0;
};

/// A row of voxels with the eight around it, seen as columns of nine.
class Columns {
 public:
  explicit Columns(std::size_t count) : left_(count), least_(count), most_(count) {}

  /// `middle`: the row; the others are `row` and `plane` away.
  void take(const Density* middle, std::ptrdiff_t row, std::ptrdiff_t plane) {
    std::int32_t* const __restrict left = left_.data();
    std::int32_t* const __restrict least = least_.data();
    std::int32_t* const __restrict most = most_.data();
    const Density* const __restrict from = middle;
    for (std::size_t x = 0; x < left_.size(); ++x) {
      const Density* const at = from + x;
      std::int32_t differences[3], low = at[0], high = at[0];
      for (std::ptrdiff_t z = -1; z <= 1; ++z) {
        const std::int32_t a = at[z * plane - row], b = at[z * plane], c = at[z * plane + row];
        differences[z + 1] = a - 2 * b + c;
        low = std::min({low, a, b, c});
        high = std::max({high, a, b, c});
      }
      left[x] = differences[0] - 2 * differences[1] + differences[2];
      least[x] = low;
      most[x] = high;
    }
  }
  /// Whether none of the 27 about x is at an end of the window.
  [[nodiscard]] bool tells(std::size_t x) const {
    return std::min({least_[x - 1], least_[x], least_[x + 1]}) > 0 &&
           std::max({most_[x - 1], most_[x], most_[x + 1]}) < 65535;
  }
  [[nodiscard]] std::int32_t left(std::size_t x) const {
    return left_[x - 1] - 2 * left_[x] + left_[x + 1];
  }

 private:
  std::vector<std::int32_t> left_, least_, most_;
};

/// What the second differences leave at the voxels that count.
ValueCounts left_in(const VoxelGrid& grid, std::span<const Density> density, Density iso) {
  ValueCounts left(kMostLeft + 1);
  const auto nx = static_cast<std::size_t>(grid.nx);
  Columns columns(nx);
  for (std::int32_t z = 1; z + 1 < grid.nz; ++z) {
    for (std::int32_t y = 1; y + 1 < grid.ny; ++y) {
      const Density* const row = &density[grid.index(0, y, z)];
      if (std::none_of(row, row + nx, [iso](Density d) { return d >= iso; })) continue;
      columns.take(row, grid.nx, std::ptrdiff_t{grid.nx} * grid.ny);
      for (std::size_t x = 1; x + 1 < nx; ++x) {
        if (row[x] >= iso && columns.tells(x)) {
          left.add(static_cast<std::size_t>(std::abs(columns.left(x))));
        }
      }
    }
  }
  return left;
}

/// The median of what is softer than the iso.
std::size_t air_of(std::span<const Density> density, Density iso) {
  ValueCounts soft(65536);
  for (const Density d : density) {
    if (d < iso) soft.add(d);
  }
  return soft.median();
}

}  // namespace

std::size_t levels_of(std::span<const Density> density) {
  std::bitset<65536> seen;
  std::size_t levels = 0;
  for (const Density d : density) {
    if (seen[d]) continue;
    seen[d] = true;
    if (++levels == kLeastLevels) break;
  }
  return levels;
}

bool is_label_map(const VoxelGrid& grid, std::span<const Density> density) {
  const auto nx = static_cast<std::size_t>(grid.nx);
  std::size_t changes = 0, own = 0;
  for (std::size_t row = 0; row < density.size(); row += nx) {
    for (std::size_t i = row + 1; i + 1 < row + nx; ++i) {
      const Density left = density[i - 1], here = density[i], right = density[i + 1];
      if (left == right) continue;
      ++changes;
      own += here != left && here != right ? 1 : 0;
    }
  }
  return 10 * own < changes;
}

Noise noise_of(const VoxelGrid& grid, std::span<const Density> density, Density iso) {
  if (levels_of(density) < kLeastLevels) return {};
  const ValueCounts left = left_in(grid, density, iso);
  if (left.total() < kLeastNoisy) return {};
  const double deviation = static_cast<double>(left.median()) / (kMedian * kGain);
  const double step = 2.0 * (iso - static_cast<double>(air_of(density, iso)));
  return {deviation / kDensityMax, step > 0 ? deviation / step : 0};
}

int passes_for(const Noise& noise) noexcept {
  return static_cast<int>(
      std::ranges::count_if(kMostNoise, [&](double most) { return noise.share > most; }));
}

}  // namespace kerf
