// SPDX-License-Identifier: Apache-2.0
#include "visualizer/render/iso_renderer.hpp"

#include <algorithm>
#include <cmath>

#include "visualizer/cast/cast_kernels.hpp"
#include "visualizer/gl/context.hpp"

namespace kerf {

namespace {

constexpr GLuint kEntryUnit = 4;  // after the textures of VolumeOnGpu
constexpr GLuint kPaletteUnit = 5;

/// What gradient.frag asks for.
std::string_view define_of(GradientFilter gradient) {
  switch (gradient) {
    case GradientFilter::central:
      return "#define KERF_GRADIENT_CENTRAL\n";
    case GradientFilter::farid5:
      return "#define KERF_GRADIENT_FARID5\n";
    case GradientFilter::corners:
      break;
  }
  return {};
}

constexpr TexelFormat kGradientTexel{GL_RGBA16_SNORM, GL_RGBA, GL_SHORT, GL_LINEAR};
constexpr std::int32_t kGradientReach = gradient_reach(GradientFilter::farid5);

}  // namespace

VolumeOnGpu::VolumeOnGpu(const VolumeView& volume, const VolumeContent& content,
                         int max_texture_size, bool skip_empty, GradientFilter gradient)
    : solid_(volume, content, max_texture_size),
      cells_(volume, content.density, skip_empty ? volume.iso : Density{0}) {
  if (gradient != GradientFilter::farid5) return;
  const VoxelGrid& grid = solid_.bricks().grid;
  gradient_.emplace(grid, kGradientTexel);
  for_each_layer(grid, [&](const VoxelBox& layer) { upload_gradient(content.density, layer); });
}

void VolumeOnGpu::update_bricks(std::span<const Density> density, const ChangedBricks& changed) {
  solid_.update_bricks(density, changed);
  if (gradient_) {
    const BrickGrid& bricks = solid_.bricks();
    for (const ChangedBrick& brick : changed) {
      const VoxelBox around = bricks.voxels(brick.id).grown(kGradientReach);
      upload_gradient(density, around.clipped(bricks.grid.box()));
    }
  }
  cells_.update_bricks(density, changed);
}

void VolumeOnGpu::upload_gradient(std::span<const Density> density, const VoxelBox& box) {
  fill_gradients(GradientFilter::farid5, solid_.bricks().grid, density, box, gradients_);
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

void VolumeOnGpu::set_transform(const glm::dmat4& world_from_voxel) {
  solid_.set_transform(world_from_voxel);
  cells_.set_transform(world_from_voxel);
}

void VolumeOnGpu::bind(const GlProgram& program, const View& view) const {
  solid_.bind(program, view);
  cells_.bind(2);
  if (gradient_) gradient_->bind(3);
}

IsoRenderer::IsoRenderer(const SceneView& scene, std::span<const VolumeContent> contents,
                         Options options)
    : Renderer(scene.volumes.size()),
      gradient_(scene.gradient),
      cast_program_({"screen.vert", "iso.frag", "volume_sample.frag", "gradient.frag", "ray.frag",
                     options.light},
                    define_of(scene.gradient)),
      palette_(palette_texture(scene.materials)) {
  const int limit = query_gl_driver().max_texture_size_3d;
  volumes_.reserve(scene.volumes.size());
  for (std::size_t i = 0; i < scene.volumes.size(); ++i) {
    volumes_.emplace_back(scene.volumes[i], contents[i], limit, options.skip_empty, scene.gradient);
  }
  SolidOnGpu::set_units(cast_program_, static_cast<int>(kPaletteUnit));
  cast_program_.set("u_active_cell", 2);
  cast_program_.set("u_gradient", 3);
  cast_program_.set("u_entry_mm", static_cast<int>(kEntryUnit));
  cast_program_.set("u_step_vox", options.step_vox);
}

RayFootprint IsoRenderer::footprint() const noexcept {
  RayFootprint footprint = Renderer::footprint();
  if (gradient_ != GradientFilter::corners) {
    // The kernels know where the normals of one gradient point; of others a tap may be anywhere,
    // and a density is interpolated between two voxels.
    footprint.at_end = static_cast<int>(2.0F * (kLongestTapVox + 1.0F)) + 1;
    footprint.taps_normal = false;
  }
  return footprint;
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
