// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/denoise.hpp"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "controller/volume/crop_resample.hpp"
#include "controller/volume/windowing.hpp"

namespace kerf {
namespace {

constexpr int kStages = kDenoiseReach;  // of (1 - B)^4; each reaches one voxel further
constexpr int kFineBits = 7;  // 64 * 2.68 * 65535 * 2^7 still fits; 2.68: the most 3 stages leave

using Plane = std::vector<std::int32_t>;

/// Takes planes one after the other and returns each, a plane later, as r - B r.
///
/// A plane has a rim of kStages voxels for the results of the stages in the air outside. Its
/// outermost voxels stay 0: no stage reads beyond them.
class Stage {
 public:
  Stage(std::size_t width, std::size_t voxels)
      : width_(width), before_(voxels), once_(voxels), twice_(voxels), rows_(3 * width) {}

  /// In: plane z. Out: plane z - 1 of r - B r.
  void pass(Plane& plane) {
    const std::size_t last = plane.size() / width_ - 1;
    blur_row(plane, 0);
    blur_row(plane, 1);
    for (std::size_t y = 1; y < last; ++y) {
      blur_row(plane, y + 1);
      take_row(plane, y);
    }
  }

 private:
  [[nodiscard]] std::int32_t* row(std::size_t y) { return &rows_[y % 3 * width_]; }

  /// [1 2 1] along x.
  void blur_row(const Plane& plane, std::size_t y) {
    const std::int32_t* const __restrict from = &plane[y * width_];
    std::int32_t* const __restrict to = row(y);
    for (std::size_t x = 1; x + 1 < width_; ++x) to[x] = from[x - 1] + 2 * from[x] + from[x + 1];
  }

  /// [1 2 1] along y and z. Of the plane before, `once_` is blurred along x and y, and `twice_` is
  /// two of it and the one before that.
  void take_row(Plane& plane, std::size_t y) {
    constexpr int kBits = 6, kHalf = 1 << (kBits - 1);  // the weights of B sum to 64
    const std::int32_t* const __restrict low = row(y - 1);
    const std::int32_t* const __restrict middle = row(y);
    const std::int32_t* const __restrict high = row(y + 1);
    std::int32_t* const __restrict value = &plane[y * width_];
    std::int32_t* const __restrict before = &before_[y * width_];
    std::int32_t* const __restrict once = &once_[y * width_];
    std::int32_t* const __restrict twice = &twice_[y * width_];
    for (std::size_t x = 1; x + 1 < width_; ++x) {
      const std::int32_t blurred = low[x] + 2 * middle[x] + high[x], now = value[x];
      value[x] = before[x] - ((twice[x] + blurred + kHalf) >> kBits);
      before[x] = now;
      twice[x] = once[x] + 2 * blurred;
      once[x] = blurred;
    }
  }

  std::size_t width_;
  Plane before_, once_, twice_;
  std::vector<std::int32_t> rows_;
};

void denoise_once(const VoxelGrid& grid, std::span<Density> density) {
  const std::size_t nx = static_cast<std::size_t>(grid.nx), ny = static_cast<std::size_t>(grid.ny);
  const std::size_t width = nx + 2 * std::size_t{kStages};
  Plane plane(width * (ny + 2 * std::size_t{kStages}));
  std::vector<Stage> stages(kStages, Stage(width, plane.size()));
  const auto rows = [&](std::int32_t z, const auto& each) {
    for (std::size_t y = 0; y < ny; ++y) {
      each(&plane[(y + kStages) * width + kStages],
           density.subspan((static_cast<std::size_t>(z) * ny + y) * nx, nx));
    }
  };
  for (std::int32_t z = 0; z < grid.nz + kStages; ++z) {
    std::ranges::fill(plane, 0);
    if (z < grid.nz) {
      rows(z, [](std::int32_t* to, std::span<const Density> from) {
        for (const Density d : from) *to++ = std::int32_t{d} << kFineBits;
      });
    }
    for (Stage& stage : stages) stage.pass(plane);
    if (z < kStages) continue;
    rows(z - kStages, [](const std::int32_t* noise, std::span<Density> of) {
      for (Density& d : of) {
        const std::int32_t rest = d - ((*noise++ + (1 << (kFineBits - 1))) >> kFineBits);
        d = static_cast<Density>(std::clamp(rest, 0, 65535));
      }
    });
  }
}

}  // namespace

void denoise(const VoxelGrid& grid, std::span<Density> density, int passes) {
  for (int i = 0; i < passes; ++i) denoise_once(grid, density);
}

VolumeImage crop_for_passes(const VolumeImage& image, Density iso, int passes) {
  const VoxelBox solid = solid_box(image, iso);
  if (solid.empty()) return image;
  return crop(image, solid.grown(kGuardVoxels + passes * kDenoiseReach)
                         .clipped(image.grid.box().grown(kGuardVoxels)));
}

namespace {

// The weights of [1 -2 1] along three axes: their squares sum to 6^3, their magnitudes to 4^3.
constexpr double kGain = 14.696938456699069;                // sqrt(216), of white noise
constexpr double kMedian = 0.67448975019608171;             // of |x|, x normal with deviation 1
constexpr std::size_t kMostLeft = std::size_t{32} * 65535;  // half of the magnitudes are positive

/// Histogram of values, and their median.
class ValueCounts {
 public:
  explicit ValueCounts(std::size_t values) : counts_(values) {}

  void add(std::size_t value) {
    ++counts_[value];
    ++total_;
  }
  [[nodiscard]] std::size_t total() const { return total_; }
  /// 0 if nothing was added.
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
  /// Whether none of the 27 voxels around x is at an end of the window.
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

/// The second differences at the voxels that count.
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

/// The median density below the iso.
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
