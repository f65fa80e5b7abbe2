// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "visualizer/gl/program.hpp"
#include "visualizer/gl/target.hpp"

namespace kerf {

/// Where translucent things gather before they go over a picture: light in linear numbers, which a
/// sum of hundreds of faint samples needs, and the window depth of the nearest that is seen. So the
/// picture's own depth can be read meanwhile, and rays end at what is opaque.
class TranslucentLayer {
 public:
  /// Makes the empty layer the place to draw, with two outputs: colour times opacity, and depth (1
  /// where nothing is seen). No depth test; blending is off. Only the parts of `target` are
  /// emptied, and their bounds are the scissor.
  void begin(const RenderTarget& target);
  /// Puts the layer over `target`: colour blended as sRGB, as meshes are, and depth. A pixel whose
  /// depth is not before the target's stays as it is.
  void finish(const RenderTarget& target);

 private:
  struct Buffer {
    explicit Buffer(PictureSize size);
    PictureSize size;
    GlTexture2D colour = GlTexture2D::create();
    GlTexture2D depth = GlTexture2D::create();
    GlFramebuffer framebuffer = GlFramebuffer::create();
  };

  GlProgram program_{"screen.vert", "layer.frag", "lighting.frag"};
  std::optional<Buffer> buffer_;
};

}  // namespace kerf
