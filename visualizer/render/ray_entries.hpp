// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "visualizer/gl/program.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/texture/cells_on_gpu.hpp"
#include "visualizer/view/camera.hpp"

namespace kerf {

/// Per pixel, where its ray first meets an active macrocell of a volume, in mm along the view axis:
/// drawn from the faces between active and empty cells. The far plane where it meets none, the near
/// plane where it begins in one. One layer for each volume.
class RayEntries {
 public:
  explicit RayEntries(int layers) : layers_(layers) {}

  /// Draws `layer` within the bounds of `target`'s parts. Leaves its own framebuffer bound, the
  /// depth test on and nothing culled.
  void draw(int layer, const CellsOnGpu& cells, const View& view, const RenderTarget& target);
  /// The layers as a texture array.
  void bind(GLuint unit) const { glBindTextureUnit(unit, buffer_->entry_mm.id()); }

 private:
  struct Buffer {
    Buffer(PictureSize size, int layers);
    PictureSize size;
    GlTexture2DArray entry_mm = GlTexture2DArray::create();
    GlTexture2D depth = GlTexture2D::create();
    GlFramebuffer framebuffer = GlFramebuffer::create();
  };

  int layers_;
  GlProgram program_{"cell_faces.vert", "cell_faces.frag"};
  std::optional<Buffer> buffer_;
};

}  // namespace kerf
