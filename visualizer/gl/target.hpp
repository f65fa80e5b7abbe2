// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "visualizer/gl/gl_objects.hpp"
#include "visualizer/scene/pixel_rect.hpp"

namespace kerf {

/// An off-screen picture: RGBA8 colour, or GL_RGBA32F, and 32-bit float depth.
class RenderTarget {
 public:
  explicit RenderTarget(PictureSize size, GLenum colour = GL_RGBA8);

  [[nodiscard]] PictureSize size() const noexcept { return size_; }
  [[nodiscard]] GLuint colour_texture() const noexcept { return colour_.id(); }
  [[nodiscard]] GLuint depth_texture() const noexcept { return depth_.id(); }
  [[nodiscard]] GLuint framebuffer() const noexcept { return framebuffer_.id(); }

  [[nodiscard]] PixelRect all() const noexcept { return {0, 0, size_.width, size_.height}; }
  /// The parts that may be drawn, none empty; all of it at first.
  [[nodiscard]] std::span<const PixelRect> parts() const noexcept { return parts_; }
  /// The smallest rectangle that holds them.
  [[nodiscard]] const PixelRect& bounds() const noexcept { return bounds_; }
  void restrict_to(std::span<const PixelRect> parts);
  void restrict_to(const PixelRect& part) { restrict_to({&part, 1}); }

  /// Binds the framebuffer, with the whole size as the viewport and the bounds as the scissor.
  void bind() const;
  /// Calls `draw` once per part with the scissor set to it, then sets the scissor back to the
  /// bounds.
  template <class Draw>
  void for_parts(const Draw& draw) const {
    for_parts(parts_, draw);
  }
  /// Calls `draw` for each of `parts`, which lie within the target's own.
  template <class Draw>
  void for_parts(std::span<const PixelRect> parts, const Draw& draw) const {
    for (const PixelRect& part : parts) {
      scissor(part);
      draw();
    }
    scissor(bounds_);
  }
  /// Draws one triangle over each of `parts`, with the program in use.
  void cover(std::span<const PixelRect> parts) const;
  void cover() const { cover(parts_); }
  /// Copies colour and depth of `part` from a target of the same size.
  void copy(const RenderTarget& from, const PixelRect& part) const;
  /// Copies the colour of `part` of another target to the same pixels of this one, or to those
  /// `right` pixels farther right; all of it must fit.
  void copy_colour(const RenderTarget& from, const PixelRect& part, int right = 0) const;
  /// Upscales `parts` from a smaller image of the same picture, with filtering. Leaves the scissor
  /// at the last part.
  void enlarge(const RenderTarget& from, std::span<const PixelRect> parts) const;
  /// RGB, 3 bytes per pixel, first row at the top. Waits until the picture is complete.
  [[nodiscard]] std::vector<std::uint8_t> read_rgb() const;
  /// The numbers of a target of floats, unchanged; first row at the top.
  [[nodiscard]] std::vector<float> read_floats() const;
  /// Window depth 0..1, first row at the top.
  [[nodiscard]] std::vector<float> read_depth() const;
  /// Window depth 0..1 of `part`, which lies inside the picture; first row at the bottom.
  [[nodiscard]] std::vector<float> read_depth(const PixelRect& part) const;

 private:
  static void scissor(const PixelRect& part);

  PictureSize size_;
  std::vector<PixelRect> parts_{all()};
  PixelRect bounds_{all()};
  GlTexture2D colour_ = GlTexture2D::create();
  GlTexture2D depth_ = GlTexture2D::create();
  GlFramebuffer framebuffer_ = GlFramebuffer::create();
  GlVertexArray no_vertices_ = GlVertexArray::create();
};

}  // namespace kerf
