// SPDX-License-Identifier: Apache-2.0
#include "visualizer/render/blend_renderer.hpp"

#include "visualizer/gl/program.hpp"

namespace kerf {

BlendRenderer::BlendRenderer(const SceneView& scene, std::span<const VolumeContent> contents,
                             Options options)
    : volumes_(scene, contents, options.skip_empty),
      entries_(static_cast<int>(scene.volumes.size())),
      cast_program_(
          {"screen.vert", "blend.frag", "matter.frag", "ray.frag", "lighting.frag", "depth.frag"},
          volumes_.defines()) {
  volumes_.set_constants(cast_program_);
  cast_program_.set("u_entry_mm", static_cast<int>(volumes_.free_unit()));
  cast_program_.set("u_opaque_depth", static_cast<int>(volumes_.free_unit() + 1));
  cast_program_.set("u_step_mm", options.step_vox * static_cast<float>(volumes_.edge_mm()));
}

void BlendRenderer::draw(const View& view, const RenderTarget& target) {
  int layer = 0;
  for (const TranslucentVolume& volume : volumes_.volumes()) {
    entries_.draw(layer++, volume.cells(), view, target);
  }
  layer_.begin(target);
  volumes_.bind(cast_program_, view);
  set_view(cast_program_, view);
  entries_.bind(volumes_.free_unit());
  glBindTextureUnit(volumes_.free_unit() + 1, target.depth_texture());
  cast_program_.use();
  target.cover();
  layer_.finish(target);
}

}  // namespace kerf
