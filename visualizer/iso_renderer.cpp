// SPDX-License-Identifier: Apache-2.0
#include "visualizer/iso_renderer.hpp"

#include <array>

#include <glm/gtc/matrix_inverse.hpp>

#include "visualizer/gl/context.hpp"
#include "visualizer/palette.hpp"

namespace kerf {

namespace {

constexpr GLuint kEntryUnit = 3;  // after the textures of VolumeOnGpu
constexpr GLuint kPaletteUnit = 4;

}  // namespace

IsoRenderer::IsoRenderer(const SceneView& scene, std::span<const VolumeContent> contents,
                         Options options)
    : options_(options) {
  const int limit = query_gl_driver().max_texture_size_3d;
  volumes_.reserve(scene.volumes.size());
  for (std::size_t i = 0; i < scene.volumes.size(); ++i) {
    volumes_.emplace_back(scene.volumes[i], contents[i], limit, options.skip_empty);
  }
  const auto palette = make_palette(scene.materials);
  glTextureStorage2D(palette_.id(), 1, GL_RGBA32F, kPaletteWidth, 2);
  glTextureSubImage2D(palette_.id(), 0, 0, 0, kPaletteWidth, 2, GL_RGBA, GL_FLOAT, palette.data());
  glTextureParameteri(palette_.id(), GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTextureParameteri(palette_.id(), GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTextureParameteri(palette_.id(), GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);

  cast_program_.set("u_density", 0);
  cast_program_.set("u_label", 1);
  cast_program_.set("u_active_cell", 2);
  cast_program_.set("u_entry_mm", static_cast<int>(kEntryUnit));
  cast_program_.set("u_palette", static_cast<int>(kPaletteUnit));
  cast_program_.set("u_step_vox", options.step_vox);
}

void IsoRenderer::update(std::size_t volume, std::span<const Density> density,
                         std::span<const std::uint32_t> changed) {
  volumes_[volume].update_bricks(density, changed);
}

IsoRenderer::EntryBuffer::EntryBuffer(PictureSize of_size) : size(of_size) {
  glTextureStorage2D(entry_mm.id(), 1, GL_R32F, size.width, size.height);
  glTextureParameteri(entry_mm.id(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTextureParameteri(entry_mm.id(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glTextureStorage2D(depth.id(), 1, GL_DEPTH_COMPONENT32F, size.width, size.height);
  glNamedFramebufferTexture(framebuffer.id(), GL_COLOR_ATTACHMENT0, entry_mm.id(), 0);
  glNamedFramebufferTexture(framebuffer.id(), GL_DEPTH_ATTACHMENT, depth.id(), 0);
}

void IsoRenderer::draw(const View& view, const RenderTarget& target) {
  if (!entries_ || entries_->size != target.size()) entries_.emplace(target.size());
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
  for (const VolumeOnGpu& volume : volumes_) {
    draw_entries(volume, view);
    cast_rays(volume, view, target);
  }
}

void IsoRenderer::draw_entries(const VolumeOnGpu& volume, const View& view) {
  const std::array<float, 4> nowhere{static_cast<float>(view.far_mm)};
  const float farthest = 1.0F;
  glBindFramebuffer(GL_FRAMEBUFFER, entries_->framebuffer.id());
  glViewport(0, 0, entries_->size.width, entries_->size.height);
  glClearNamedFramebufferfv(entries_->framebuffer.id(), GL_COLOR, 0, nowhere.data());
  glClearNamedFramebufferfv(entries_->framebuffer.id(), GL_DEPTH, 0, &farthest);
  entry_program_.set("u_clip_from_cell", glm::mat4(view.clip_from_eye() * view.eye_from_world *
                                                   volume.world_from_cell()));
  entry_program_.set("u_near_mm", static_cast<float>(view.near_mm));
  entry_program_.use();
  // Faces before the near or beyond the far plane count too: they say where a ray is inside.
  glEnable(GL_DEPTH_CLAMP);
  glDepthFunc(GL_LEQUAL);
  volume.draw_cell_faces();
  glDisable(GL_DEPTH_CLAMP);
  glDepthFunc(GL_LESS);
}

void IsoRenderer::cast_rays(const VolumeOnGpu& volume, const View& view,
                            const RenderTarget& target) {
  target.bind();
  volume.bind_textures();
  glBindTextureUnit(kEntryUnit, entries_->entry_mm.id());
  glBindTextureUnit(kPaletteUnit, palette_.id());
  const glm::dmat4 texture_from_eye =
      glm::affineInverse(view.eye_from_world * volume.world_from_texture());
  cast_program_.set("u_texture_from_eye", glm::mat4(texture_from_eye));
  cast_program_.set("u_texels", glm::vec3(volume.texels()));
  cast_program_.set("u_half_size_at_1mm",
                    glm::vec2(view.tan_half_height * view.aspect, view.tan_half_height));
  cast_program_.set("u_up_eye", glm::vec3(view.eye_from_world * glm::dvec4(0, 1, 0, 0)));
  cast_program_.set("u_near_mm", static_cast<float>(view.near_mm));
  cast_program_.set("u_far_mm", static_cast<float>(view.far_mm));
  cast_program_.set("u_iso", volume.iso());
  cast_program_.set("u_has_labels", volume.has_labels() ? 1 : 0);
  cast_program_.use();
  glBindVertexArray(no_vertices_.id());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

}  // namespace kerf
