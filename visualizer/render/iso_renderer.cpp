// SPDX-License-Identifier: Apache-2.0
#include "visualizer/render/iso_renderer.hpp"

#include "visualizer/gl/context.hpp"

namespace kerf {

namespace {

constexpr GLuint kEntryUnit = 5;  // after the textures of VolumeOnGpu
constexpr GLuint kPaletteUnit = 6;
constexpr std::int32_t kFineCellVox = 2;

constexpr TexelFormat kGradientTexel{GL_RGBA16, GL_RGBA, GL_UNSIGNED_SHORT, GL_LINEAR};

}  // namespace

VolumeOnGpu::VolumeOnGpu(const VolumeView& volume, const VolumeContent& content,
                         int max_texture_size, bool skip_empty, GradientFilter gradient)
    : edges_mm_(volume.edges_mm()),
      solid_(volume, content, max_texture_size),
      cells_(volume, content.density, skip_empty ? volume.iso : Density{0}),
      fine_cells_(volume.bricks, content.density, skip_empty ? volume.iso : Density{0},
                  kFineCellVox),
      gradient_(GradientPlan(gradient, volume.edges_mm()), volume.bricks.grid, content.density),
      gradient_texture_(volume.bricks.grid, kGradientTexel, GradientRows::kNone.data()) {
  gradient_texture_.upload_from(gradient_.data(), volume.bricks.grid.box().grown(kBorder), kBorder);
}

void VolumeOnGpu::update_bricks(std::span<const Density> density, const ChangedBricks& changed) {
  solid_.update_bricks(density, changed);
  for (const VoxelBox& around : gradient_.update(changed, density)) {
    gradient_texture_.upload_from(gradient_.data(), around, kBorder);
  }
  cells_.update_bricks(density, changed);
  fine_cells_.update_bricks(density, changed);
}

void VolumeOnGpu::set_transform(const glm::dmat4& world_from_voxel) {
  solid_.set_transform(world_from_voxel);
  cells_.set_transform(world_from_voxel);
}

void VolumeOnGpu::bind(const GlProgram& program, const View& view) const {
  solid_.bind(program, view);
  cells_.bind(2);
  fine_cells_.bind(3);
  gradient_texture_.bind(4);
  program.set("u_edges_mm", edges_mm_);
  program.set("u_gradient_scale",
              gradient_.plan().per_edge * glm::vec3(texels_of(solid_.bricks().grid)));
}

IsoRenderer::IsoRenderer(const SceneView& scene, std::span<const VolumeContent> contents,
                         Options options)
    : Renderer(scene.volumes.size()),
      cast_program_({"screen.vert", "iso.frag", "volume_sample.frag", "gradient.frag", "ray.frag",
                     options.light}),
      palette_(palette_texture(scene.materials)) {
  const int limit = query_gl_driver().max_texture_size_3d;
  volumes_.reserve(scene.volumes.size());
  for (std::size_t i = 0; i < scene.volumes.size(); ++i) {
    volumes_.emplace_back(scene.volumes[i], contents[i], limit, options.skip_empty, scene.gradient);
  }
  SolidOnGpu::set_units(cast_program_, static_cast<int>(kPaletteUnit));
  cast_program_.set("u_active_cell", 2);
  cast_program_.set("u_fine_cell", 3);
  cast_program_.set("u_gradient", 4);
  cast_program_.set("u_entry_mm", static_cast<int>(kEntryUnit));
}

void IsoRenderer::draw(const View& view, const RenderTarget& target) {
  for (const VolumeOnGpu& volume : volumes_) {
    entries_.draw(0, volume.cells(), view, target);
    cast_rays(volume, view, target);
  }
}

void IsoRenderer::cast_rays(const VolumeOnGpu& volume, const View& view,
                            const RenderTarget& target) {
  target.bind();
  volume.bind(cast_program_, view);
  entries_.bind(kEntryUnit);
  glBindTextureUnit(kPaletteUnit, palette_.id());
  set_view(cast_program_, view);
  cast_program_.use();
  target.cover();
}

}  // namespace kerf
