// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/windowing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <sstream>
#include <type_traits>
#include <vector>

#include "controller/input/load_error.hpp"

namespace kerf {

OtsuSplit otsu_split(std::span<const double> counts) {
  double total = 0.0, total_sum = 0.0;
  for (std::size_t bin = 0; bin < counts.size(); ++bin) {
    total += counts[bin];
    total_sum += counts[bin] * static_cast<double>(bin);
  }
  // Both ends of the range of best thresholds; counts are whole, so equal parts compare equal.
  double best = 0.0, below = 0.0, below_sum = 0.0;
  std::size_t first = counts.size() / 2, last = first;
  OtsuSplit split;
  for (std::size_t bin = 1; bin < counts.size(); ++bin) {  // classes: [0, bin) and [bin, end)
    below += counts[bin - 1];
    below_sum += counts[bin - 1] * static_cast<double>(bin - 1);
    if (below == 0.0 || below == total) continue;
    const double low = below_sum / below, high = (total_sum - below_sum) / (total - below);
    const double between = below * (total - below) * (low - high) * (low - high);
    if (between > best) {
      best = between;
      first = bin;
      split.low_mean = low;
      split.high_mean = high;
    }
    if (between == best) last = bin;
  }
  split.bin = static_cast<double>(first + last) / 2.0;
  return split;
}

Window range_window(const SourceVolume& source) noexcept {
  return {source.min, source.max};
}

VolumeImage apply_window(const SourceVolume& source, Window window) {
  const double width = window.hi - window.lo;
  if (!(width > 0.0) || !std::isfinite(width)) {
    std::ostringstream text;
    text << "window: " << window.lo << ".." << window.hi
         << " is empty; the values of the file go from " << source.min << " to " << source.max;
    if (source.min == source.max) {
      text << ", so there is nothing to see in it";
    } else {
      text << ", give `window = [lo, hi]` in the scene or `--window lo,hi` with lo < hi";
    }
    throw LoadError(text.str());
  }
  VolumeImage image;
  static_cast<VolumeFrame&>(image) = source;
  image.density.resize(source.values.size());
  const double scale = kDensityMax / width;
  const auto density = [&](double value) { return nearest_density((value - window.lo) * scale); };
  source.values.visit([&]<class T>(std::span<const T> values) {
    if constexpr (std::is_same_v<T, float>) {
      std::ranges::transform(values, image.density.begin(),
                             [&](float v) { return density(static_cast<double>(v)); });
    } else {  // each of the 65536 values once
      std::vector<Density> of(std::size_t{1} << 16);
      for (std::size_t i = 0; i < of.size(); ++i) of[i] = density(static_cast<T>(i));
      std::ranges::transform(values, image.density.begin(),
                             [&](T v) { return of[static_cast<std::uint16_t>(v)]; });
    }
  });
  return image;
}

Density otsu_threshold(const VolumeImage& image) {
  constexpr int kBinBits = 12;
  constexpr int kShift = 16 - kBinBits;
  std::array<double, 1 << kBinBits> count{};
  for (const Density d : image.density) count[d >> kShift] += 1.0;

  return static_cast<Density>(otsu_split(count).bin * (1 << kShift));
}

VoxelBox solid_box(const VolumeImage& image, Density iso) noexcept {
  VoxelBox box{{image.grid.nx, image.grid.ny, image.grid.nz}, {0, 0, 0}};
  const Density* row = image.density.data();
  for (std::int32_t z = 0; z < image.grid.nz; ++z) {
    for (std::int32_t y = 0; y < image.grid.ny; ++y, row += image.grid.nx) {
      const Density* const end = row + image.grid.nx;
      const auto solid = [iso](Density d) { return d >= iso; };
      const Density* const left = std::find_if(row, end, solid);
      if (left == end) continue;
      const Density* right = end;
      while (!solid(right[-1])) --right;
      box.lo = {std::min(box.lo.x, static_cast<std::int32_t>(left - row)), std::min(box.lo.y, y),
                std::min(box.lo.z, z)};
      box.hi = {std::max(box.hi.x, static_cast<std::int32_t>(right - row)),
                std::max(box.hi.y, y + 1), z + 1};
    }
  }
  return box.empty() ? VoxelBox{} : box;
}

}  // namespace kerf
