// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "controller/volume/file/volume_image.hpp"

// Volumes cut to a box, enclosed in air, and on another spacing.

namespace kerf {

/// Layers of voxels kept around the solid ones, so that gradients and the first contact of the tool
/// find neighbours there.
inline constexpr std::int32_t kGuardVoxels = 3;

/// The part of `image` inside `box`, density and labels; the origin moves along, so every voxel
/// keeps its position. Outside of the image the box has air. Throws LoadError for an empty box or
/// one above the limits of volume_image.hpp.
[[nodiscard]] VolumeImage crop(const VolumeImage& image, const VoxelBox& box);

/// The image with one layer of air around it if a voxel of at least `least` lies at its border, so
/// that a solid that ends there has a surface. Else the image unchanged.
[[nodiscard]] VolumeImage enclosed_in_air(VolumeImage image, Density least);

/// Crops to the tightest box around the voxels of at least `iso`, plus `guard` voxels on each side.
/// Throws LoadError if no voxel is solid.
[[nodiscard]] VolumeImage crop_to_solid(const VolumeImage& image, Density iso,
                                        std::int32_t guard = kGuardVoxels);

/// Lets a cropped image end in air: its last layer becomes air, the densities of the one before are
/// halved. All other voxels, and so the surface, stay: solid voxels are `kGuardVoxels` from the
/// border.
void fade_to_air(VolumeImage& image);

/// Resamples a volume to another spacing. Per axis: linear interpolation if the new voxels are
/// smaller, the mean over the extent of the new voxel if they are larger; labels take the nearest.
///
/// The outer face of the first voxel stays in place; only new voxels that lie whole inside the old
/// extent are made (at least one). A density ramp is kept exactly by refinement and by whole
/// ratios, else within an eighth of an old voxel's step; each is rounded once, at the end. Throws
/// LoadError for a spacing that is not positive or a result above the limits.
[[nodiscard]] VolumeImage resample(const VolumeImage& image,
                                   const std::array<double, 3>& spacing_mm);

}  // namespace kerf
