// SPDX-License-Identifier: Apache-2.0
#include "visualizer/render/ray_entries.hpp"

#include <array>

namespace kerf {

RayEntries::Buffer::Buffer(PictureSize of_size, int layers) : size(of_size) {
  glTextureStorage3D(entry_mm.id(), 1, GL_R32F, size.width, size.height, layers);
  read_nearest(entry_mm.id());
  glTextureStorage2D(depth.id(), 1, GL_DEPTH_COMPONENT32F, size.width, size.height);
  glNamedFramebufferTexture(framebuffer.id(), GL_DEPTH_ATTACHMENT, depth.id(), 0);
}

void RayEntries::draw(int layer, const CellsOnGpu& cells, const View& view,
                      const RenderTarget& target) {
  const PictureSize size = target.size();
  const PixelRect& part = target.bounds();
  if (!buffer_ || buffer_->size != size) buffer_.emplace(size, layers_);
  const std::array<float, 4> nowhere{static_cast<float>(view.far_mm)};
  const float farthest = 1.0F;
  const GLuint framebuffer = buffer_->framebuffer.id();
  glNamedFramebufferTextureLayer(framebuffer, GL_COLOR_ATTACHMENT0, buffer_->entry_mm.id(), 0,
                                 layer);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glViewport(0, 0, size.width, size.height);
  glEnable(GL_SCISSOR_TEST);
  glScissor(part.x0, part.y0, part.x1 - part.x0, part.y1 - part.y0);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
  glClearNamedFramebufferfv(framebuffer, GL_COLOR, 0, nowhere.data());
  glClearNamedFramebufferfv(framebuffer, GL_DEPTH, 0, &farthest);
  program_.set("u_clip_from_cell",
               glm::mat4(view.clip_from_eye() * view.eye_from_world * cells.world_from_cell()));
  program_.set("u_near_mm", static_cast<float>(view.near_mm));
  program_.use();
  // Faces before the near plane count too: they say where a ray is inside.
  glEnable(GL_DEPTH_CLAMP);
  cells.draw_faces();
  glDisable(GL_DEPTH_CLAMP);
}

}  // namespace kerf
