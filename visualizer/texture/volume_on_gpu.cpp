// SPDX-License-Identifier: Apache-2.0
#include "visualizer/texture/volume_on_gpu.hpp"

#include <algorithm>
#include <cmath>

namespace kerf {

namespace {

constexpr TexelFormat kGradientTexel{GL_RGBA16_SNORM, GL_RGBA, GL_SHORT, GL_LINEAR};
constexpr std::int32_t kGradientReach = gradient_reach(Gradient::farid5);

}  // namespace

VolumeOnGpu::VolumeOnGpu(const VolumeView& volume, const VolumeContent& content,
                         int max_texture_size, bool skip_empty, Gradient gradient)
    : solid_(volume, content, max_texture_size),
      cells_(volume, content.density, skip_empty ? volume.iso : Density{0}) {
  if (gradient != Gradient::farid5) return;
  const VoxelGrid& grid = solid_.bricks().grid;
  gradient_.emplace(grid, kGradientTexel);
  for_each_layer(grid, [&](const VoxelBox& layer) { upload_gradient(content.density, layer); });
}

void VolumeOnGpu::update_bricks(std::span<const Density> density,
                                std::span<const std::uint32_t> changed) {
  solid_.update_bricks(density, changed);
  if (gradient_) {
    const BrickGrid& bricks = solid_.bricks();
    for (const std::uint32_t id : changed) {
      const VoxelBox around = bricks.voxels(id).grown(kGradientReach);
      upload_gradient(density, around.clipped(bricks.grid.box()));
    }
  }
  cells_.update_bricks(density, changed);
}

void VolumeOnGpu::upload_gradient(std::span<const Density> density, const VoxelBox& box) {
  fill_gradients(Gradient::farid5, solid_.bricks().grid, density, box, gradients_);
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
  solid_.place(world_from_voxel);
  cells_.place(world_from_voxel);
}

void VolumeOnGpu::bind(const GlProgram& program, const View& view) const {
  solid_.bind(program, view);
  cells_.bind(2);
  if (gradient_) gradient_->bind(3);
}

}  // namespace kerf
