// SPDX-License-Identifier: Apache-2.0
#include "visualizer/texture/solid_on_gpu.hpp"

#include <glm/gtc/matrix_inverse.hpp>

#include "visualizer/view/transfer_function.hpp"

namespace kerf {

namespace {

constexpr TexelFormat kDensityTexel{GL_R16, GL_RED, GL_UNSIGNED_SHORT, GL_LINEAR};
constexpr TexelFormat kLabelTexel{GL_R8UI, GL_RED_INTEGER, GL_UNSIGNED_BYTE, GL_NEAREST};
constexpr GLuint kDensityUnit = 0;
constexpr GLuint kLabelUnit = 1;

const VoxelGrid& checked_grid(const VolumeView& volume, int max_texture_size) {
  check_extent(volume, max_texture_size);
  return volume.bricks.grid;
}

}  // namespace

SolidOnGpu::SolidOnGpu(const VolumeView& volume, const VolumeContent& content, int max_texture_size)
    : bricks_(volume.bricks),
      has_labels_(!content.labels.empty()),
      iso_(static_cast<float>(volume.iso / kDensityMax)),
      world_from_texture_(kerf::world_from_texture(volume.world_from_voxel, volume.bricks.grid)),
      density_(checked_grid(volume, max_texture_size), kDensityTexel),
      labels_(has_labels_ ? bricks_.grid : VoxelGrid{}, kLabelTexel) {
  const VoxelBox whole = bricks_.grid.box();
  density_.upload_from(content.density.data(), whole);
  if (has_labels_) labels_.upload_from(content.labels.data(), whole);
}

void SolidOnGpu::update_bricks(std::span<const Density> density,
                               std::span<const std::uint32_t> changed) {
  for (const std::uint32_t id : changed) density_.upload_from(density.data(), bricks_.voxels(id));
}

void SolidOnGpu::place(const glm::dmat4& world_from_voxel) {
  world_from_texture_ = kerf::world_from_texture(world_from_voxel, bricks_.grid);
}

void SolidOnGpu::set_units(const GlProgram& program, int palette) {
  program.set("u_density", static_cast<int>(kDensityUnit));
  program.set("u_label", static_cast<int>(kLabelUnit));
  program.set("u_palette", palette);
}

void SolidOnGpu::bind(const GlProgram& program, const View& view) const {
  density_.bind(kDensityUnit);
  labels_.bind(kLabelUnit);
  const glm::dmat4 texture_from_eye = glm::affineInverse(view.eye_from_world * world_from_texture_);
  program.set("u_texture_from_eye", glm::mat4(texture_from_eye));
  program.set("u_texels", glm::vec3(texels_of(bricks_.grid)));
  program.set("u_iso", iso_);
  program.set("u_has_labels", has_labels_ ? 1 : 0);
}

GlTexture2D palette_texture(std::span<const MaterialView> materials) {
  const Palette palette = make_palette(materials);
  GlTexture2D texture = GlTexture2D::create();
  glTextureStorage2D(texture.id(), 1, GL_RGBA32F, kPaletteWidth, 2);
  glTextureSubImage2D(texture.id(), 0, 0, 0, kPaletteWidth, 2, GL_RGBA, GL_FLOAT, palette.data());
  glTextureParameteri(texture.id(), GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTextureParameteri(texture.id(), GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTextureParameteri(texture.id(), GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return texture;
}

}  // namespace kerf
