// SPDX-License-Identifier: Apache-2.0
#include "visualizer/render/section_faces.hpp"

#include "visualizer/gl/context.hpp"
#include "visualizer/render/view_uniforms.hpp"
#include "visualizer/view/screen_bounds.hpp"

namespace kerf {

namespace {

constexpr GLuint kPaletteUnit = 2;  // after the textures of SolidOnGpu

/// The parts of the target in which a volume may show.
std::vector<PixelRect> parts_of(const SolidOnGpu& volume, const View& view,
                                const RenderTarget& target) {
  BoxCorners corners;
  for (unsigned c = 0; c < corners.size(); ++c) {
    const glm::dvec4 corner(c & 1U, c >> 1 & 1U, c >> 2, 1.0);
    corners[c] = glm::dvec3(volume.world_from_texture() * corner);
  }
  const PixelRect bounds = screen_bounds(corners, view, target.size());
  std::vector<PixelRect> parts;
  for (const PixelRect& part : target.parts()) {
    const PixelRect both = part.clipped(bounds);
    if (!both.empty()) parts.push_back(both);
  }
  return parts;
}

}  // namespace

SectionFaces::SectionFaces(const SceneView& scene, std::span<const VolumeContent> contents)
    : palette_(palette_texture(scene.materials)) {
  const int limit = query_gl_driver().max_texture_size_3d;
  volumes_.reserve(scene.volumes.size());
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    volumes_.emplace_back(scene.volumes[v], contents[v], limit);
  }
  SolidOnGpu::set_units(program_, static_cast<int>(kPaletteUnit));
}

void SectionFaces::update(std::size_t volume, std::span<const Density> density,
                          std::span<const std::uint32_t> changed) {
  volumes_[volume].update_bricks(density, changed);
}

void SectionFaces::place(std::size_t volume, const glm::dmat4& world_from_voxel) {
  volumes_[volume].place(world_from_voxel);
}

void SectionFaces::draw(const View& view, const RenderTarget& target) const {
  target.bind();
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glBindTextureUnit(kPaletteUnit, palette_.id());
  glBindVertexArray(no_vertices_.id());
  set_view(program_, view);
  for (const SolidOnGpu& volume : volumes_) {
    volume.bind(program_, view);
    program_.use();
    target.for_parts(parts_of(volume, view, target), [] { glDrawArrays(GL_TRIANGLES, 0, 3); });
  }
}

}  // namespace kerf
