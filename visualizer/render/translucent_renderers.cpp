// SPDX-License-Identifier: Apache-2.0

#include "visualizer/render/translucent_renderers.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "visualizer/gl/program.hpp"

namespace kerf {

BlendRenderer::BlendRenderer(const SceneView& scene, std::span<const VolumeContent> contents,
                             Options options)
    : Renderer(scene.volumes.size()),
      volumes_(scene, contents, options.skip_empty),
      entries_(static_cast<int>(scene.volumes.size())),
      cast_program_(
          {"screen.vert", "blend.frag", "translucent_sample.frag", "ray.frag", "lighting.frag"},
          volumes_.defines()) {
  volumes_.set_constants(cast_program_);
  cast_program_.set("u_entry_mm", static_cast<int>(volumes_.free_unit()));
  cast_program_.set("u_opaque_depth", static_cast<int>(volumes_.free_unit() + 1));
  cast_program_.set("u_step_mm", options.step_vox * static_cast<float>(volumes_.edge_mm()));
}

void BlendRenderer::draw(const View& view, const RenderTarget& target) {
  int layer = 0;
  for (const TranslucentVolume& volume : volumes_.volumes()) {
    entries_.draw(layer++, volume.cells(), view, target);
  }
  layer_.begin(target);
  volumes_.bind(cast_program_, view);
  set_view(cast_program_, view);
  entries_.bind(volumes_.free_unit());
  glBindTextureUnit(volumes_.free_unit() + 1, target.depth_texture());
  cast_program_.use();
  target.cover();
  layer_.finish(target);
}

namespace {

SceneView with_volume(const SceneView& scene, std::size_t volume) {
  SceneView one = scene;
  one.volumes = {scene.volumes[volume]};
  return one;
}

/// The active cells in eye space, and `margin_mm` around them.
BoxCorners active_corners(const CellsOnGpu& cells, const View& view, double margin_mm) {
  const VoxelBox& box = cells.active_box();
  const glm::dmat4 eye_from_cell = view.eye_from_world * cells.world_from_cell();
  glm::dvec3 margin;
  for (int axis = 0; axis < 3; ++axis) margin[axis] = margin_mm / glm::length(eye_from_cell[axis]);
  return box_corners(glm::dvec3(box.lo.x, box.lo.y, box.lo.z) - margin,
                     glm::dvec3(box.hi.x, box.hi.y, box.hi.z) + margin, eye_from_cell);
}

}  // namespace

SlicesRenderer::Sliced::Sliced(const SceneView& scene, const VolumeContent& content)
    : volume(scene, {&content, 1}, true),
      program(
          {"slices.vert", "slices.frag", "translucent_sample.frag", "ray.frag", "lighting.frag"},
          volume.defines()) {
  volume.set_constants(program);
  program.set("u_opaque_depth", static_cast<int>(volume.free_unit()));
}

SlicesRenderer::SlicesRenderer(const SceneView& scene, std::span<const VolumeContent> contents,
                               Options options)
    : Renderer(scene.volumes.size()), options_(options) {
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    volumes_.push_back(std::make_unique<Sliced>(with_volume(scene, v), contents[v]));
    const double edge_mm = volumes_.back()->volume.edge_mm();
    edge_mm_ = v == 0 ? edge_mm : std::min(edge_mm_, edge_mm);
  }
  glVertexArrayVertexBuffer(array_.id(), 0, buffer_.id(), 0, sizeof(glm::vec3));
  glEnableVertexArrayAttrib(array_.id(), 0);
  glVertexArrayAttribFormat(array_.id(), 0, 3, GL_FLOAT, GL_FALSE, 0);
}

void SlicesRenderer::upload(std::size_t volume, std::span<const Density> density,
                            const ChangedBricks& changed) {
  volumes_[volume]->volume.volumes().front().update_bricks(density, changed);
}

void SlicesRenderer::set_transform(std::size_t volume, const glm::dmat4& world_from_voxel) {
  volumes_[volume]->volume.volumes().front().set_transform(world_from_voxel);
}

void SlicesRenderer::set_opacities(std::span<const MaterialView> materials,
                                   std::span<const VolumeContent> contents) {
  for (std::size_t v = 0; v < volumes_.size(); ++v) {
    volumes_[v]->volume.set_opacities(materials, contents.subspan(v, 1));
  }
}

void SlicesRenderer::cut_volume(std::size_t volume, const View& view, double step_mm) {
  // A slice shows what lies up to a step before it, along rays that lean.
  constexpr double kMarginSteps = 2.0;
  const CellsOnGpu& cells = volumes_[volume]->volume.volumes().front().cells();
  if (cells.active_box().empty()) return;
  const BoxCorners corners = active_corners(cells, view, kMarginSteps * step_mm);
  double nearest_mm = view.far_mm;
  double farthest_mm = view.near_mm;
  for (const glm::dvec3& corner : corners) {
    nearest_mm = std::min(nearest_mm, -corner.z);
    farthest_mm = std::max(farthest_mm, -corner.z);
  }
  const int first = static_cast<int>(std::ceil(std::max(nearest_mm, view.near_mm) / step_mm));
  const int last = static_cast<int>(std::min(farthest_mm, view.far_mm + step_mm) / step_mm);
  for (int slice = first; slice <= last; ++slice) {
    const auto polygon = cut_box(corners, slice * step_mm);
    if (polygon.size() < 3) continue;
    cuts_.push_back({slice, volume, static_cast<GLint>(vertices_.size()),
                     static_cast<GLsizei>(polygon.size())});
    for (const glm::dvec2& at : polygon) vertices_.emplace_back(at, slice);
  }
}

void SlicesRenderer::draw(const View& view, const RenderTarget& target) {
  const double step_mm =
      edge_mm_ * static_cast<double>(moving_ ? options_.moving_step_vox : options_.step_vox);
  vertices_.clear();
  cuts_.clear();
  for (std::size_t v = 0; v < volumes_.size(); ++v) cut_volume(v, view, step_mm);
  std::stable_sort(cuts_.begin(), cuts_.end(),
                   [](const Cut& a, const Cut& b) { return a.slice > b.slice; });
  glNamedBufferData(buffer_.id(), static_cast<GLsizeiptr>(vertices_.size() * sizeof(glm::vec3)),
                    vertices_.data(), GL_STREAM_DRAW);

  layer_.begin(target);
  for (const auto& sliced : volumes_) {
    set_view(sliced->program, view);
    sliced->program.set("u_clip_from_eye", glm::mat4(view.clip_from_eye()));
    sliced->program.set("u_step_mm", static_cast<float>(step_mm));
  }
  glBindTextureUnit(volumes_.front()->volume.free_unit(), target.depth_texture());
  glBindVertexArray(array_.id());
  // Over what is there, and the depth of the nearest.
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glBlendEquationi(1, GL_MIN);
  glEnable(GL_DEPTH_CLAMP);  // a slice before the near plane shows what lies behind it
  draw_cuts(view, target);
  glDisable(GL_DEPTH_CLAMP);
  glBlendEquationi(1, GL_FUNC_ADD);
  layer_.finish(target);
}

void SlicesRenderer::draw_cuts(const View& view, const RenderTarget& target) const {
  // As many slices in one call as are of one volume.
  for (auto begin = cuts_.begin(); begin != cuts_.end();) {
    const Sliced& sliced = *volumes_[begin->volume];
    const auto end = std::find_if(begin, cuts_.end(),
                                  [&](const Cut& cut) { return cut.volume != begin->volume; });
    std::vector<GLint> firsts;
    std::vector<GLsizei> counts;
    std::for_each(begin, end, [&](const Cut& cut) {
      firsts.push_back(cut.first);
      counts.push_back(cut.count);
    });
    sliced.volume.bind(sliced.program, view);
    sliced.program.use();
    target.for_parts([&] {
      glMultiDrawArrays(GL_TRIANGLE_FAN, firsts.data(), counts.data(),
                        static_cast<GLsizei>(firsts.size()));
    });
    begin = end;
  }
}

std::vector<glm::dvec2> cut_box(const BoxCorners& eye_corners, double eye_mm) {
  std::vector<glm::dvec2> vertices;
  for (std::size_t from = 0; from < eye_corners.size(); ++from) {
    for (const std::size_t axis : {1U, 2U, 4U}) {
      if ((from & axis) != 0) continue;  // each of the twelve edges once
      const glm::dvec3& a = eye_corners[from];
      const glm::dvec3& b = eye_corners[from | axis];
      const double before = -a.z - eye_mm;
      const double behind = -b.z - eye_mm;
      if ((before < 0.0) == (behind < 0.0)) continue;
      vertices.emplace_back(glm::mix(a, b, before / (before - behind)));
    }
  }
  const glm::dvec2 middle = std::accumulate(vertices.begin(), vertices.end(), glm::dvec2(0.0)) /
                            static_cast<double>(std::max<std::size_t>(vertices.size(), 1));
  const auto angle = [&](glm::dvec2 v) { return std::atan2(v.y - middle.y, v.x - middle.x); };
  std::sort(vertices.begin(), vertices.end(),
            [&](glm::dvec2 a, glm::dvec2 b) { return angle(a) < angle(b); });
  return vertices;
}

}  // namespace kerf
