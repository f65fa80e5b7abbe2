// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "controller/volume/volume_denoise.hpp"
#include "shared/volume/voxel_grid.hpp"

// What the noise of a volume is, and how many passes of the filter it takes (docs/theory.md 2.4).
// Load time. The same on every machine.

namespace kerf {

/// A standard deviation.
struct Noise {
  double density = 0;  ///< as a share of full density
  double share = 0;    ///< as a share of the surface's step: from air to twice as far as the iso
};

/// A volume of fewer levels of density has no noise, or none that is told from its steps.
inline constexpr std::size_t kLeastLevels = 16;
/// From fewer voxels no noise is told: then they are mostly those along edges, whose differences
/// pass for noise, as in a tooth on 48 x 48 x 30 voxels.
inline constexpr std::size_t kLeastNoisy = 2000;

/// How many different densities there are; `kLeastLevels` stands for any more.
[[nodiscard]] std::size_t levels_of(std::span<const Density> density);

/// Whether density only steps, as the numbers of labels do: along x, where it changes from one side
/// of a voxel to the other, fewer than one voxel in ten has a density of its own.
[[nodiscard]] bool is_label_map(const VoxelGrid& grid, std::span<const Density> density);

/// The noise of what is solid: the median of the magnitudes that a second difference along all
/// three axes leaves, 0 in all that is even or a ramp along any axis. Counted are voxels of at
/// least `iso` where neither they nor their 26 neighbours are at an end of the window: air and what
/// is clipped have another noise. None, where these are fewer than `kLeastNoisy`, or the levels
/// fewer than `kLeastLevels`.
[[nodiscard]] Noise noise_of(const VoxelGrid& grid, std::span<const Density> density, Density iso);

/// Up to which share of the surface's step noise may be smoothed with 0, 1 .. passes.
inline constexpr std::array<double, kMostPasses> kMostNoise{0.008, 0.018, 0.0206};

/// The fewest passes after which contact keeps its limits on noise of that share, or all there are.
[[nodiscard]] int passes_for(const Noise& noise) noexcept;

}  // namespace kerf
