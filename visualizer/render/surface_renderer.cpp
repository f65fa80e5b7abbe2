// SPDX-License-Identifier: Apache-2.0
#include "visualizer/render/surface_renderer.hpp"

#include <utility>

#include <glm/gtc/matrix_inverse.hpp>

#include "visualizer/gl/context.hpp"
#include "visualizer/scene/camera.hpp"

namespace kerf {

namespace {

/// The parts of the target that may be drawn, in normalised device coordinates.
std::vector<FrustumCulling::Part> drawn_parts(const RenderTarget& target) {
  const glm::dvec2 per_pixel = 2.0 / glm::dvec2(target.size().width, target.size().height);
  std::vector<FrustumCulling::Part> parts;
  for (const PixelRect& part : target.parts()) {
    parts.push_back({glm::dvec2(part.x0, part.y0) * per_pixel - 1.0,
                     glm::dvec2(part.x1, part.y1) * per_pixel - 1.0});
  }
  return parts;
}

constexpr GLuint kColoursUnit = 2;  // after the textures of SolidOnGpu

constexpr std::size_t kMaxTriangles = 32768;  // a few cuts between two pictures; more become a box

/// The smallest box of voxels between which all corners lie.
VoxelBox voxels_around(std::span<const FineTriangle> triangles) {
  VoxelBox all;
  for (const FineTriangle& triangle : triangles) {
    for (const FinePoint& corner : triangle) {
      const VoxelIndex v = VolumeSamples::voxel_below(corner);
      all = all.united({v, {v.x + 2, v.y + 2, v.z + 2}});
    }
  }
  return all;
}

/// The parts of the target in which a volume may show.
std::vector<PixelRect> parts_of(const SolidOnGpu& volume, const View& view,
                                const RenderTarget& target) {
  const BoxCorners corners =
      box_corners(glm::dvec3(0.0), glm::dvec3(1.0), volume.world_from_texture());
  return clipped(target.parts(), screen_bounds(corners, view, target.size()));
}

}  // namespace

ClipCaps::ClipCaps(const SceneView& scene, std::span<const VolumeContent> contents)
    : program_({"screen.vert", "clip_cap.frag", "volume_sample.frag", "ray.frag", light_of(scene)}),
      palette_(palette_texture(scene.materials)) {
  const int limit = query_gl_driver().max_texture_size_3d;
  volumes_.reserve(scene.volumes.size());
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    volumes_.emplace_back(scene.volumes[v], contents[v], limit);
  }
  SolidOnGpu::set_units(program_, static_cast<int>(kColoursUnit));
}

void ClipCaps::draw(const View& view, const RenderTarget& target) const {
  target.bind();
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glBindTextureUnit(kColoursUnit, palette_.id());
  set_view(program_, view);
  for (const SolidOnGpu& volume : volumes_) {
    volume.bind(program_, view);
    program_.use();
    target.cover(parts_of(volume, view, target));
  }
}

SurfaceRenderer::SurfaceRenderer(const SceneView& scene, std::span<const VolumeContent> contents)
    : Renderer(scene.volumes.size()),
      scene_(scene),
      program_({"surface.vert", "surface.frag", light_of(scene)}) {
  volumes_.reserve(scene.volumes.size());
  for (std::size_t i = 0; i < scene.volumes.size(); ++i) {
    const VolumeView& view = scene.volumes[i];
    VolumeSurface surface(view, scene.materials, contents[i].density, contents[i].labels,
                          scene.gradient);
    SurfaceOnGpu gpu(surface);
    volumes_.push_back({std::move(surface), std::move(gpu)});
  }
}

void SurfaceRenderer::upload(std::size_t volume, std::span<const Density> density,
                             const ChangedBricks& changed) {
  Volume& of = volumes_[volume];
  of.gpu.update(of.surface, of.surface.update(density, changed));
  const auto triangles = of.surface.changed_triangles();
  of.changed.insert(of.changed.end(), triangles.begin(), triangles.end());
  if (of.changed.size() > kMaxTriangles) {
    of.changed_box = of.changed_box.united(voxels_around(of.changed));
    of.changed.clear();
  }
  if (caps_) caps_->volumes()[volume].update_bricks(density, changed);
}

void SurfaceRenderer::set_transform(std::size_t volume, const glm::dmat4& world_from_voxel) {
  scene_.volumes[volume].world_from_voxel = world_from_voxel;
  if (caps_) caps_->volumes()[volume].set_transform(world_from_voxel);
}

void SurfaceRenderer::set_cut_open(bool open, std::span<const VolumeContent> contents) {
  caps_.reset();
  if (open) caps_.emplace(scene_, contents);
}

void SurfaceRenderer::mark_redraw(std::size_t volume, const KeptPicture& kept,
                                  RedrawTiles& tiles) const {
  const Volume& of = volumes_[volume];
  mark_triangles(of.changed, kept, tiles);
  if (!of.changed_box.empty())
    mark_rays({&of.changed_box, 1}, footprint(kept.volume), true, nullptr, kept, tiles);
  if (caps_) Renderer::mark_redraw(volume, kept, tiles);
}

void SurfaceRenderer::forget_changes() {
  Renderer::forget_changes();
  for (Volume& volume : volumes_) {
    volume.changed.clear();
    volume.changed_box = {};
  }
}

void SurfaceRenderer::draw(const View& view, const RenderTarget& target) {
  target.bind();
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  const bool opened = view.clip_plane != View{}.clip_plane;
  (opened ? glDisable : glEnable)(GL_CULL_FACE);
  if (opened) glEnable(GL_CLIP_DISTANCE0);
  glDisable(GL_BLEND);
  program_.set("u_clip_from_eye", glm::mat4(view.clip_from_eye()));
  set_view(program_, view);
  program_.use();
  const std::vector<FrustumCulling::Part> parts = drawn_parts(target);
  for (std::size_t v = 0; v < volumes_.size(); ++v) {
    Volume& volume = volumes_[v];
    const glm::dmat4 eye_from_voxel = view.eye_from_world * scene_.volumes[v].world_from_voxel;
    program_.set("u_eye_from_voxel", glm::mat4(eye_from_voxel));
    program_.set("u_eye_from_voxel_normal",
                 glm::mat3(glm::inverseTranspose(glm::dmat3(eye_from_voxel))));
    std::optional<glm::dvec3> eye_voxel;
    if (!opened) eye_voxel = glm::dvec3(glm::affineInverse(eye_from_voxel)[3]);
    volume.gpu.draw(volume.surface,
                    FrustumCulling(view.clip_from_eye() * eye_from_voxel, eye_voxel, parts));
  }
  glDisable(GL_CULL_FACE);
  glDisable(GL_CLIP_DISTANCE0);
  if (opened && caps_) caps_->draw(view, target);
}

}  // namespace kerf
