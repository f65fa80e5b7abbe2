// SPDX-License-Identifier: Apache-2.0
#include "visualizer/render/iso_renderer.hpp"

#include "visualizer/cast/dirty_job.hpp"
#include "visualizer/gl/context.hpp"
#include "visualizer/render/view_uniforms.hpp"

namespace kerf {

namespace {

constexpr GLuint kEntryUnit = 4;  // after the textures of VolumeOnGpu
constexpr GLuint kPaletteUnit = 5;

/// What gradient.frag asks for.
std::string_view define_of(Gradient gradient) {
  switch (gradient) {
    case Gradient::central:
      return "#define KERF_GRADIENT_CENTRAL\n";
    case Gradient::farid5:
      return "#define KERF_GRADIENT_FARID5\n";
    case Gradient::corners:
      break;
  }
  return {};
}

}  // namespace

IsoRenderer::IsoRenderer(const SceneView& scene, std::span<const VolumeContent> contents,
                         Options options)
    : gradient_(scene.gradient),
      cast_program_({"screen.vert", "iso.frag", "solid.frag", "gradient.frag", "ray.frag",
                     options.light, "depth.frag"},
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
  if (gradient_ != Gradient::corners) {
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
  glBindVertexArray(no_vertices_.id());
  target.for_parts([] { glDrawArrays(GL_TRIANGLES, 0, 3); });
}

}  // namespace kerf
