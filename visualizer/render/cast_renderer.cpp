// SPDX-License-Identifier: Apache-2.0
#include "visualizer/render/cast_renderer.hpp"

#include "visualizer/scene/appearance.hpp"
#include "visualizer/scene/camera.hpp"

namespace kerf {

namespace {

std::vector<CastContent> cast_contents(const SceneView& scene,
                                       std::span<const VolumeContent> contents) {
  std::vector<CastContent> all;
  for (std::size_t i = 0; i < contents.size(); ++i) {
    all.push_back(
        {contents[i].density, contents[i].labels, make_transfer_function(scene, i, contents[i])});
  }
  return all;
}

Caster::Options cast_options(CastMode mode) {
  Caster::Options options;
  options.mode = mode;
  return options;
}

std::size_t first_pixel(const PixelRect& rect, std::int32_t width) {
  return static_cast<std::size_t>(rect.y0) * static_cast<std::size_t>(width) +
         static_cast<std::size_t>(rect.x0);
}

}  // namespace

CastRenderer::CastRenderer(const SceneView& scene, std::span<const VolumeContent> contents,
                           CastMode mode)
    : Renderer(scene.volumes.size()),
      mode_(mode),
      normals_(scene.normals && mode == CastMode::iso),
      caster_(scene, cast_contents(scene, contents), cast_options(mode)) {
  program_.set("u_colour", 0);
  program_.set("u_depth", 1);
}

void CastRenderer::set_opacities(std::span<const MaterialView> materials,
                                 std::span<const VolumeContent> /*contents*/) {
  caster_.set_materials(make_palette(materials));
}

CastRenderer::Frame::Frame(PictureSize size, bool has_normals) {
  picture.resize(size.width, size.height);
  end_depth.resize(picture.depth.size());
  if (has_normals) normals.resize(3 * picture.depth.size());
  glTextureStorage2D(colour.id(), 1, has_normals ? GL_RGB32F : GL_RGBA8, size.width, size.height);
  glTextureStorage2D(depth.id(), 1, GL_R32F, size.width, size.height);
  for (const GlTexture2D* texture : {&colour, &depth}) read_nearest(texture->id());
}

CastRenderer::Frame& CastRenderer::frame_of(PictureSize size) {
  constexpr std::size_t kMost = 2;
  for (Frame& frame : frames_) {
    if (PictureSize{frame.picture.width, frame.picture.height} == size) return frame;
  }
  if (frames_.size() == kMost) frames_.pop_front();
  return frames_.emplace_back(size, normals_);
}

void CastRenderer::draw(const View& view, const RenderTarget& target) {
  const PictureSize size = target.size();
  parts_ = clipped(target.parts(), bounds(view, size));
  if (parts_.empty()) return;
  Frame& frame = frame_of(size);
  const PixelRect drawn = united(parts_);
  const bool ends_at_target = mode_ == CastMode::blend;
  if (ends_at_target) read_end_depth(frame, target, drawn);
  caster_.draw(view, parts_, frame.picture,
               ends_at_target ? std::span<const float>(frame.end_depth) : std::span<float>(),
               frame.normals);
  upload(frame, drawn);
  show(frame, target);
}

PixelRect CastRenderer::bounds(const View& view, PictureSize size) const {
  PixelRect bounds;
  for (const BoxCorners& body : caster_.bodies()) {
    bounds = bounds.united(screen_bounds(body, view, size));
  }
  return bounds;
}

void CastRenderer::read_end_depth(Frame& frame, const RenderTarget& target, const PixelRect& rect) {
  const std::int32_t width = frame.picture.width;
  glBindFramebuffer(GL_READ_FRAMEBUFFER, target.framebuffer());
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glPixelStorei(GL_PACK_ROW_LENGTH, width);
  glReadPixels(rect.x0, rect.y0, rect.x1 - rect.x0, rect.y1 - rect.y0, GL_DEPTH_COMPONENT, GL_FLOAT,
               frame.end_depth.data() + first_pixel(rect, width));
  glPixelStorei(GL_PACK_ROW_LENGTH, 0);
}

void CastRenderer::upload(const Frame& frame, const PixelRect& rect) {
  const CastPicture& picture = frame.picture;
  const std::size_t first = first_pixel(rect, picture.width);
  const GLsizei wide = rect.x1 - rect.x0;
  const GLsizei high = rect.y1 - rect.y0;
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, picture.width);
  if (frame.normals.empty()) {
    glTextureSubImage2D(frame.colour.id(), 0, rect.x0, rect.y0, wide, high, GL_RGBA,
                        GL_UNSIGNED_BYTE, picture.rgba.data() + first);
  } else {
    glTextureSubImage2D(frame.colour.id(), 0, rect.x0, rect.y0, wide, high, GL_RGB, GL_FLOAT,
                        frame.normals.data() + 3 * first);
  }
  glTextureSubImage2D(frame.depth.id(), 0, rect.x0, rect.y0, wide, high, GL_RED, GL_FLOAT,
                      picture.depth.data() + first);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
}

void CastRenderer::show(const Frame& frame, const RenderTarget& target) {
  target.bind();
  glBindTextureUnit(0, frame.colour.id());
  glBindTextureUnit(1, frame.depth.id());
  program_.use();
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  if (mode_ == CastMode::blend) {
    glEnable(GL_BLEND);
    glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  } else {
    glDisable(GL_BLEND);
  }
  target.cover(parts_);
}

}  // namespace kerf
