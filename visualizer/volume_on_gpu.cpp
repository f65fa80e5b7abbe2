// SPDX-License-Identifier: Apache-2.0
#include "visualizer/volume_on_gpu.hpp"

namespace kerf {

namespace {

constexpr TexelFormat kDensityTexel{GL_R16, GL_RED, GL_UNSIGNED_SHORT, GL_LINEAR};
constexpr TexelFormat kLabelTexel{GL_R8UI, GL_RED_INTEGER, GL_UNSIGNED_BYTE, GL_NEAREST};
constexpr VoxelGrid kNoVoxels{};

const VoxelGrid& checked_grid(const VolumeView& volume, int max_texture_size) {
  check_extent(volume, max_texture_size);
  return volume.bricks.grid;
}

}  // namespace

VolumeOnGpu::VolumeOnGpu(const VolumeView& volume, const VolumeContent& content,
                         int max_texture_size, bool skip_empty)
    : bricks_(volume.bricks),
      has_labels_(!content.labels.empty()),
      iso_(static_cast<float>(volume.iso / kDensityMax)),
      world_from_texture_(kerf::world_from_texture(volume)),
      density_(checked_grid(volume, max_texture_size), kDensityTexel),
      labels_(has_labels_ ? bricks_.grid : kNoVoxels, kLabelTexel),
      cells_(volume, content.density, skip_empty ? volume.iso : Density{0}) {
  const VoxelBox whole = bricks_.grid.box();
  density_.upload_from(content.density.data(), whole);
  if (has_labels_) labels_.upload_from(content.labels.data(), whole);
}

void VolumeOnGpu::update_bricks(std::span<const Density> density,
                                std::span<const std::uint32_t> changed) {
  for (const std::uint32_t id : changed) density_.upload_from(density.data(), bricks_.voxels(id));
  cells_.update_bricks(density, changed);
}

void VolumeOnGpu::bind_textures() const {
  density_.bind(0);
  labels_.bind(1);
  cells_.bind(2);
}

}  // namespace kerf
