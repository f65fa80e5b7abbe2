// SPDX-License-Identifier: Apache-2.0
#include "visualizer/gl/target.hpp"

#include <algorithm>

namespace kerf {

namespace {

/// GL's first row is the lowest one.
template <class T>
void flip_rows(std::vector<T>& picture, std::size_t row, std::size_t rows) {
  for (std::size_t y = 0; y < rows / 2; ++y) {
    const auto upper = picture.begin() + static_cast<std::ptrdiff_t>(y * row);
    const auto lower = picture.begin() + static_cast<std::ptrdiff_t>((rows - 1 - y) * row);
    std::swap_ranges(upper, upper + static_cast<std::ptrdiff_t>(row), lower);
  }
}

/// RGB of each pixel, the first row at the top.
template <class T>
std::vector<T> read_colours(const GlFramebuffer& from, PictureSize size, GLenum type) {
  const auto row = static_cast<std::size_t>(size.width) * 3;
  const auto rows = static_cast<std::size_t>(size.height);
  std::vector<T> rgb(row * rows);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, from.id());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, size.width, size.height, GL_RGB, type, rgb.data());
  flip_rows(rgb, row, rows);
  return rgb;
}

void copy_texture(const GlTexture2D& from, const GlTexture2D& to, const PixelRect& r, int right) {
  if (r.empty()) return;
  glCopyImageSubData(from.id(), GL_TEXTURE_2D, 0, r.x0, r.y0, 0, to.id(), GL_TEXTURE_2D, 0,
                     right + r.x0, r.y0, 0, r.x1 - r.x0, r.y1 - r.y0, 1);
}

}  // namespace

RenderTarget::RenderTarget(PictureSize size, GLenum colour) : size_(size) {
  glTextureStorage2D(colour_.id(), 1, colour, size.width, size.height);
  glTextureParameteri(colour_.id(), GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTextureParameteri(colour_.id(), GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTextureParameteri(colour_.id(), GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glTextureStorage2D(depth_.id(), 1, GL_DEPTH_COMPONENT32F, size.width, size.height);
  glNamedFramebufferTexture(framebuffer_.id(), GL_COLOR_ATTACHMENT0, colour_.id(), 0);
  glNamedFramebufferTexture(framebuffer_.id(), GL_DEPTH_ATTACHMENT, depth_.id(), 0);
}

void RenderTarget::restrict_to(std::span<const PixelRect> parts) {
  parts_ = clipped(parts, all());
  bounds_ = united(parts_);
}

void RenderTarget::scissor(const PixelRect& part) {
  glScissor(part.x0, part.y0, part.x1 - part.x0, part.y1 - part.y0);
}

void RenderTarget::bind() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
  glViewport(0, 0, size_.width, size_.height);
  glEnable(GL_SCISSOR_TEST);
  scissor(bounds_);
}

void RenderTarget::cover(std::span<const PixelRect> parts) const {
  glBindVertexArray(no_vertices_.id());
  for_parts(parts, [] { glDrawArrays(GL_TRIANGLES, 0, 3); });
}

void RenderTarget::copy(const RenderTarget& from, const PixelRect& part) const {
  copy_colour(from, part);
  copy_texture(from.depth_, depth_, part.clipped(all()), 0);
}

void RenderTarget::copy_colour(const RenderTarget& from, const PixelRect& part, int right) const {
  copy_texture(from.colour_, colour_, part.clipped(from.all()), right);
}

void RenderTarget::enlarge(const RenderTarget& from, std::span<const PixelRect> parts) const {
  glEnable(GL_SCISSOR_TEST);
  for (const PixelRect& part : parts) {
    scissor(part);
    glBlitNamedFramebuffer(from.framebuffer(), framebuffer(), 0, 0, from.size_.width,
                           from.size_.height, 0, 0, size_.width, size_.height, GL_COLOR_BUFFER_BIT,
                           GL_LINEAR);
  }
}

std::vector<std::uint8_t> RenderTarget::read_rgb() const {
  return read_colours<std::uint8_t>(framebuffer_, size_, GL_UNSIGNED_BYTE);
}

std::vector<float> RenderTarget::read_floats() const {
  return read_colours<float>(framebuffer_, size_, GL_FLOAT);
}

std::vector<float> RenderTarget::read_depth() const {
  std::vector<float> depth = read_depth(all());
  flip_rows(depth, static_cast<std::size_t>(size_.width), static_cast<std::size_t>(size_.height));
  return depth;
}

std::vector<float> RenderTarget::read_depth(const PixelRect& part) const {
  std::vector<float> depth(static_cast<std::size_t>(part.area()));
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_.id());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(part.x0, part.y0, part.x1 - part.x0, part.y1 - part.y0, GL_DEPTH_COMPONENT, GL_FLOAT,
               depth.data());
  return depth;
}

}  // namespace kerf
