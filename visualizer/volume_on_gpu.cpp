// SPDX-License-Identifier: Apache-2.0
#include "visualizer/volume_on_gpu.hpp"

#include <algorithm>
#include <cmath>

namespace kerf {

namespace {

constexpr TexelFormat kDensityTexel{GL_R16, GL_RED, GL_UNSIGNED_SHORT, GL_LINEAR};
constexpr TexelFormat kLabelTexel{GL_R8UI, GL_RED_INTEGER, GL_UNSIGNED_BYTE, GL_NEAREST};
constexpr TexelFormat kGradientTexel{GL_RGBA16_SNORM, GL_RGBA, GL_SHORT, GL_LINEAR};
constexpr VoxelGrid kNoVoxels{};
constexpr std::int32_t kGradientReach = gradient_reach(Gradient::farid5);

const VoxelGrid& checked_grid(const VolumeView& volume, int max_texture_size) {
  check_extent(volume, max_texture_size);
  return volume.bricks.grid;
}

}  // namespace

VolumeOnGpu::VolumeOnGpu(const VolumeView& volume, const VolumeContent& content,
                         int max_texture_size, bool skip_empty, Gradient gradient)
    : bricks_(volume.bricks),
      has_labels_(!content.labels.empty()),
      iso_(static_cast<float>(volume.iso / kDensityMax)),
      world_from_texture_(kerf::world_from_texture(volume.world_from_voxel, volume.bricks.grid)),
      density_(checked_grid(volume, max_texture_size), kDensityTexel),
      labels_(has_labels_ ? bricks_.grid : kNoVoxels, kLabelTexel),
      cells_(volume, content.density, skip_empty ? volume.iso : Density{0}) {
  const VoxelBox whole = bricks_.grid.box();
  density_.upload_from(content.density.data(), whole);
  if (has_labels_) labels_.upload_from(content.labels.data(), whole);
  if (gradient != Gradient::farid5) return;
  gradient_.emplace(bricks_.grid, kGradientTexel);
  for_each_layer(bricks_.grid,
                 [&](const VoxelBox& layer) { upload_gradient(content.density, layer); });
}

void VolumeOnGpu::update_bricks(std::span<const Density> density,
                                std::span<const std::uint32_t> changed) {
  for (const std::uint32_t id : changed) density_.upload_from(density.data(), bricks_.voxels(id));
  if (gradient_) {
    for (const std::uint32_t id : changed) {
      const VoxelBox around = bricks_.voxels(id).grown(kGradientReach);
      upload_gradient(density, around.clipped(bricks_.grid.box()));
    }
  }
  cells_.update_bricks(density, changed);
}

void VolumeOnGpu::upload_gradient(std::span<const Density> density, const VoxelBox& box) {
  fill_gradients(Gradient::farid5, bricks_.grid, density, box, gradients_);
  texels_.clear();
  for (const glm::vec3& g : gradients_) {
    const auto part = [](float value) {
      constexpr float kOne = 32767.0F;
      return static_cast<std::int16_t>(std::lround(std::clamp(value, -1.0F, 1.0F) * kOne));
    };
    texels_.push_back({part(g.x), part(g.y), part(g.z), 0});
  }
  gradient_->upload(texels_.data(), box);
}

void VolumeOnGpu::place(const glm::dmat4& world_from_voxel) {
  world_from_texture_ = kerf::world_from_texture(world_from_voxel, bricks_.grid);
  cells_.place(world_from_voxel);
}

void VolumeOnGpu::bind_textures() const {
  density_.bind(0);
  labels_.bind(1);
  cells_.bind(2);
  if (gradient_) gradient_->bind(3);
}

}  // namespace kerf
