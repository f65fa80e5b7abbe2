// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/volume/file/volume_image.hpp"
#include "shared/volume/voxel_grid.hpp"

// The filter against the noise of a volume, and the estimate of that noise, from which the number
// of passes follows (docs/theory.md 2.4). Load time; the same bits on every machine.

namespace kerf {

/// Most passes: so many move the face of a scanned ball of 6 voxels by at most 0.017 voxels, and an
/// edge of that radius by half as much; the limit is 0.02, which a fourth would reach
/// (docs/theory.md 2.4).
inline constexpr int kMostPasses = 3;

/// Reach of a pass, voxels.
inline constexpr std::int32_t kDenoiseReach = 4;

/// Smooths a volume in place: each pass subtracts (1 - B)^4 of the density, B the binomial
/// [1 2 1] / 4 along every axis. That is Tukey's twicing of Tukey's twicing: its second, fourth and
/// sixth moments are 0, so faces and edges keep their position.
///
/// Outside of the grid is air. In whole numbers, so every machine makes the same bits: each (1 - B)
/// is rounded to 1/128 of a step of density, the pass to a whole one, and clamped to 0..65535.
/// Density that is constant over 4 voxels stays bit by bit. Load time; takes 13 planes of 32 bits.
void denoise(const VoxelGrid& grid, std::span<Density> density, int passes);

/// Crops to the solid voxels with their guard, plus the reach of so many passes. The image
/// unchanged if no voxel is solid.
[[nodiscard]] VolumeImage crop_for_passes(const VolumeImage& image, Density iso, int passes);

/// A standard deviation.
struct Noise {
  double density = 0;  ///< relative to full density
  double share =
      0;  ///< relative to the step of the surface, which is twice that from air to the iso
};

/// A volume of fewer levels of density has no noise, or none that can be separated from its steps.
inline constexpr std::size_t kLeastLevels = 16;
/// Fewer voxels are too few for an estimate: most of them are along edges, whose differences look
/// like noise, as in a tooth on 48 x 48 x 30 voxels.
inline constexpr std::size_t kLeastNoisy = 2000;

/// Number of different densities, at most `kLeastLevels`.
[[nodiscard]] std::size_t levels_of(std::span<const Density> density);

/// Whether the density only steps, as label numbers do: of the voxels whose two neighbours along x
/// differ, fewer than one in ten has a third density.
[[nodiscard]] bool is_label_map(const VoxelGrid& grid, std::span<const Density> density);

/// The noise of the solid voxels: the median magnitude of a second difference along all three axes,
/// which is 0 for a constant and for a ramp along any axis. Counted are voxels of at least `iso` if
/// neither they nor their 26 neighbours are at an end of the window: air and clipped values have
/// another noise. None if these are fewer than `kLeastNoisy`, or the levels fewer than
/// `kLeastLevels`.
[[nodiscard]] Noise noise_of(const VoxelGrid& grid, std::span<const Density> density, Density iso);

/// Largest `Noise::share` for 0, 1 .. passes.
inline constexpr std::array<double, kMostPasses> kMostNoise{0.008, 0.018, 0.0206};

/// The fewest passes after which contact keeps its limits on such noise, at most kMostPasses.
[[nodiscard]] int passes_for(const Noise& noise) noexcept;

}  // namespace kerf
