// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/surface_choice.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "controller/volume/otsu.hpp"

namespace kerf {
namespace {

using Counts = std::vector<double>;

constexpr std::size_t kBins = 65536;
/// Pads outside of the scanner's circle lie below air; noise of air reaches so far from -1000.
constexpr double kAirWidthHu = 100;
constexpr double kLeastAirShare = 0.01;
/// A CT image has 16 bits a voxel (DICOM PS3.3 C.8.2.1.1.4).
constexpr double kHighestHu = 65535;
/// Compact bone ends there; metal would pull Otsu's threshold (3 mm spine with a hip joint: 1365 HU
/// without this bound, 220 to 260 HU for any from 1000 to 2000).
constexpr double kBoneEndsHu = 1500;
/// Muscle, organs and blood stay below.
constexpr double kSoftEndsHu = 120;
/// Fewer voxels at the top are outliers, which would pull a threshold.
constexpr double kOutliers = 1e-4;
/// A denser class is another material where it stands so much higher above air than what it is
/// parted from: noise of 10 % of one material gives 1.17.
constexpr double kLeastContrast = 1.2;
/// Of the faces of the denser class, those with air near by. Enamel on dentine shows one of its two
/// sides: 0.55 to 0.6 in the two CT teeth; bone in the CT hand 0.05.
constexpr double kBareShare = 0.25;

class ValueScale {
 public:
  explicit ValueScale(Window range) : range_(range) {}
  [[nodiscard]] double value(double density) const {
    return range_.lo + (range_.hi - range_.lo) * density / kDensityMax;
  }
  [[nodiscard]] std::size_t bin(double value) const {
    return nearest_density((value - range_.lo) / (range_.hi - range_.lo) * kDensityMax);
  }

 private:
  Window range_;
};

/// Otsu's rule on the bins from `first` on; what is above `last` counts there.
OtsuSplit split_between(const Counts& counts, std::size_t first, std::size_t last) {
  Counts part(counts.size());
  for (std::size_t bin = first; bin < counts.size(); ++bin) {
    part[std::min(bin, last)] += counts[bin];
  }
  return otsu_split(part);
}

double share_between(const Counts& counts, std::size_t first, std::size_t last) {
  double inside = 0, all = 0;
  for (std::size_t bin = 0; bin < counts.size(); ++bin) {
    all += counts[bin];
    if (bin >= first && bin <= last) inside += counts[bin];
  }
  return all > 0 ? inside / all : 0;
}

std::size_t top_without_outliers(const Counts& counts, std::size_t voxels) {
  double above = 0;
  std::size_t top = counts.size() - 1;
  while (top > 0 && (above += counts[top]) <= kOutliers * static_cast<double>(voxels)) --top;
  return top;
}

/// The share of faces of what is at least `hard` from which air, below `skin`, is reached straight
/// ahead within `most` voxels.
double bare_share(const VolumeImage& image, Density skin, Density hard, std::int32_t most) {
  const VoxelGrid& grid = image.grid;
  constexpr std::array<VoxelIndex, 6> kWays{
      {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
  std::uint64_t faces = 0, bare = 0;
  const auto look = [&](VoxelIndex at, VoxelIndex way) {
    for (std::int32_t step = 0; step <= most; ++step) {
      at = {at.x + way.x, at.y + way.y, at.z + way.z};
      if (!grid.contains(at)) return;
      const Density d = image.density[grid.index(at.x, at.y, at.z)];
      if (d >= hard) return;
      if (step == 0) ++faces;
      if (d >= skin) continue;
      ++bare;
      return;
    }
  };
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = 0; y < grid.ny; ++y) {
      const Density* const row = &image.density[grid.index(0, y, z)];
      for (std::int32_t x = 0; x < grid.nx; ++x) {
        if (row[x] < hard) continue;
        for (const VoxelIndex& way : kWays) look({x, y, z}, way);
      }
    }
  }
  return faces == 0 ? 1 : static_cast<double>(bare) / static_cast<double>(faces);
}

}  // namespace

SurfaceChoice choose_surface(const VolumeImage& image, Window range) {
  const ValueScale scale(range);
  Counts counts(kBins);
  for (const Density d : image.density) counts[d] += 1;
  const std::size_t top = top_without_outliers(counts, image.density.size());

  SurfaceChoice choice;
  choice.hounsfield = share_between(counts, scale.bin(kAirHu - kAirWidthHu),
                                    scale.bin(kAirHu + kAirWidthHu)) >= kLeastAirShare &&
                      range.lo <= kAirHu + kAirWidthHu && range.hi >= kWaterHu &&
                      range.hi <= kHighestHu;
  const std::size_t air = choice.hounsfield ? scale.bin(kAirHu - kAirWidthHu) : 0;
  const OtsuSplit skin = split_between(counts, air, top);
  const auto skin_bin = static_cast<Density>(skin.bin);
  choice.skin = choice.iso = scale.value(skin.bin);
  if (choice.hounsfield) {
    const OtsuSplit bone =
        split_between(counts, scale.bin(kWaterHu), std::min(top, scale.bin(kBoneEndsHu)));
    if (scale.value(bone.bin) > kSoftEndsHu) choice.hard = scale.value(bone.bin);
    choice.covered = choice.hard.has_value();
  } else {
    const OtsuSplit hard = split_between(counts, skin_bin, top);
    if (hard.high_mean > hard.low_mean &&
        hard.high_mean - skin.low_mean >= kLeastContrast * (hard.low_mean - skin.low_mean)) {
      choice.hard = scale.value(hard.bin);
      // A cover thinner than a fortieth of the volume is the blur of an edge.
      const std::int32_t near =
          std::max({image.grid.nx, image.grid.ny, image.grid.nz, 4 * 40}) / 40;
      choice.covered =
          bare_share(image, skin_bin, static_cast<Density>(hard.bin), near) < kBareShare;
    }
  }
  if (choice.covered) choice.iso = *choice.hard;
  return choice;
}

}  // namespace kerf
