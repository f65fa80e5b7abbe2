// SPDX-License-Identifier: Apache-2.0
#include "visualizer/render/screen_passes.hpp"

namespace kerf {

void ScreenPasses::draw_backdrop(const RenderTarget& target) {
  target.bind();
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_ALWAYS);
  glDisable(GL_BLEND);
  backdrop_.use();
  cover(target);
  glDepthFunc(GL_LESS);
}

void ScreenPasses::smooth_edges(const RenderTarget& from, const RenderTarget& to) {
  to.bind();
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glBindTextureUnit(0, from.colour_texture());
  smooth_.set("u_picture", 0);
  smooth_.use();
  cover(to);
}

void ScreenPasses::cover(const RenderTarget& target) {
  glBindVertexArray(no_vertices_.id());
  target.for_parts([] { glDrawArrays(GL_TRIANGLES, 0, 3); });
}

}  // namespace kerf
