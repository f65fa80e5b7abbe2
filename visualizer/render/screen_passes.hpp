// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "visualizer/gl/program.hpp"
#include "visualizer/gl/target.hpp"

namespace kerf {

/// What is drawn as one triangle over the whole picture, within the parts of its target.
class ScreenPasses {
 public:
  /// Colour, and the depth of the far plane, whatever was there.
  void draw_backdrop(const RenderTarget& target);

  /// Smooths the edges in `from`. A pixel depends on those up to `kSmoothingReach` away.
  static constexpr int kSmoothingReach = 3;
  void smooth_edges(const RenderTarget& from, const RenderTarget& to);

 private:
  void cover(const RenderTarget& target);

  GlProgram backdrop_{"screen.vert", "backdrop.frag"};
  GlProgram smooth_{"screen.vert", "smooth.frag"};
  GlVertexArray no_vertices_ = GlVertexArray::create();
};

}  // namespace kerf
