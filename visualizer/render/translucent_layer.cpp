// SPDX-License-Identifier: Apache-2.0
#include "visualizer/render/translucent_layer.hpp"

#include <array>

namespace kerf {

TranslucentLayer::Buffer::Buffer(PictureSize of_size) : size(of_size) {
  glTextureStorage2D(colour.id(), 1, GL_RGBA16F, size.width, size.height);
  glTextureStorage2D(depth.id(), 1, GL_R32F, size.width, size.height);
  for (const GlTexture2D* texture : {&colour, &depth}) read_nearest(texture->id());
  glNamedFramebufferTexture(framebuffer.id(), GL_COLOR_ATTACHMENT0, colour.id(), 0);
  glNamedFramebufferTexture(framebuffer.id(), GL_COLOR_ATTACHMENT1, depth.id(), 0);
  constexpr std::array<GLenum, 2> kOutputs{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  glNamedFramebufferDrawBuffers(framebuffer.id(), kOutputs.size(), kOutputs.data());
}

void TranslucentLayer::begin(const RenderTarget& target) {
  const PictureSize size = target.size();
  if (!buffer_ || buffer_->size != size) buffer_.emplace(size);
  constexpr std::array<float, 4> kNothing{};
  constexpr std::array<float, 4> kFarthest{1.0F};
  target.bind();
  glBindFramebuffer(GL_FRAMEBUFFER, buffer_->framebuffer.id());
  target.for_parts([&] {
    glClearBufferfv(GL_COLOR, 0, kNothing.data());
    glClearBufferfv(GL_COLOR, 1, kFarthest.data());
  });
  glViewport(0, 0, size.width, size.height);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
}

void TranslucentLayer::finish(const RenderTarget& target) {
  target.bind();
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDisable(GL_CULL_FACE);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_ONE, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
  glBindTextureUnit(0, buffer_->colour.id());
  glBindTextureUnit(1, buffer_->depth.id());
  program_.set("u_colour", 0);
  program_.set("u_depth", 1);
  program_.use();
  target.cover();
  glDisable(GL_BLEND);
}

}  // namespace kerf
