// SPDX-License-Identifier: Apache-2.0
#include "visualizer/render/blend_renderer.hpp"

#include "visualizer/render/view_uniforms.hpp"

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
  glBindVertexArray(no_vertices_.id());
  target.for_parts([] { glDrawArrays(GL_TRIANGLES, 0, 3); });
  layer_.finish(target);
}

}  // namespace kerf
