// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "controller/volume/file/volume_image.hpp"

namespace kerf {

/// So many passes move the face of a scanned ball of 6 voxels by at most 0.017 voxels, and an edge
/// of that radius by half as much; the limit is 0.02, which a fourth would take up
/// (docs/theory.md 2.4).
inline constexpr int kMostPasses = 3;

/// How far a pass reaches.
inline constexpr std::int32_t kDenoiseReach = 4;

/// Smooths a volume in place: each pass takes away (1 - B)^4 of the density, B the binomial
/// [1 2 1] / 4 along every axis. That is Tukey's twicing of Tukey's twicing: its second, fourth and
/// sixth moments are 0, so faces and edges stay where they are.
///
/// Outside of the grid is air. In whole numbers, so every machine makes the same bits: each (1 - B)
/// is rounded to 1/128 of a step of density, the pass to a whole one, and held within 0..65535.
/// Where the density is even over 4 voxels, no bit changes. Load time; takes 13 planes of 32 bits.
void denoise(const VoxelGrid& grid, std::span<Density> density, int passes);

/// What a crop to the solid keeps and, around it, what so many passes carry into that. The image as
/// it is where nothing is solid.
[[nodiscard]] VolumeImage crop_for_passes(const VolumeImage& image, Density iso, int passes);

}  // namespace kerf
