// SPDX-License-Identifier: Apache-2.0
#include "visualizer/picture.hpp"

#include <algorithm>
#include <cmath>

namespace kerf {

namespace {

constexpr double kStaleMs = 100.0;       // a servo that is alive beats each tick
constexpr double kArrowRadiiPerN = 0.3;  // 1 N: 0.3 radii of the box; 3.3 N about one radius
constexpr double kArrowThickness = 0.014;
constexpr double kLeastArrowN = 0.01;  // below, the report does not count a contact either
constexpr double kToolRoom = 1.5;  // radii around the volumes in which the tool is never clipped
const Paint kSteel{.colour = {0.60F, 0.60F, 0.61F}, .metal = true};
const Paint kForce{.colour = {0.75F, 0.13F, 0.01F}, .metal = false};  // vermillion

glm::dvec3 vec3(const float (&v)[3]) {
  return {v[0], v[1], v[2]};
}
glm::dvec3 vec3(const double (&v)[3]) {
  return {v[0], v[1], v[2]};
}

}  // namespace

Picture::Picture(const Session& session, std::string_view renderer, double aspect)
    : scene_(session.scene()), renderer_(make_renderer(renderer, scene_, session.contents())) {
  const BoxCorners box = scene_.main_volume().corners();
  centre_mm_ = 0.5 * (box.front() + box.back());
  radius_mm_ = glm::length(box.front() - centre_mm_);
  for (const VolumeView& volume : scene_.volumes) {
    for (const glm::dvec3& corner : volume.corners()) {
      reach_mm_ = std::max(reach_mm_, glm::length(corner - centre_mm_));
    }
  }
  for (const ToolView& tool : scene_.tools) tools_.emplace_back(tool_mesh(tool.profile_mm));
  for (const VolumeView& volume : scene_.volumes) bricks_uploaded_ += volume.bricks.count();
  reset_camera(aspect);
}

void Picture::reset_camera(double aspect) {
  camera_.frame(scene_.main_volume().corners(), aspect);
}

void Picture::update(const Session& session) {
  for (std::size_t v = 0; v < scene_.volumes.size(); ++v) {
    const VolumeSnapshot& snapshot = session.snapshot(v);
    renderer_->update(v, snapshot.density, snapshot.changed);
    bricks_uploaded_ += snapshot.changed.size();
  }
}

void Picture::draw(const Session& session, const OverlayFigures& figures,
                   const RenderTarget& target) {
  const PictureSize size = target.size();
  const double aspect = static_cast<double>(size.width) / size.height;
  const View view = camera_.view(aspect, reach_mm_ + kToolRoom * radius_mm_);
  if (!stage_ || stage_->size() != size) stage_.emplace(size);
  renderer_->set_moving(last_view_ && *last_view_ != view);
  last_view_ = view;
  draw_backdrop(*stage_);
  // The tool comes before the volumes, which it may shine through.
  if (session.latest()) draw_tool(*session.latest(), view, *stage_);
  renderer_->draw(view, *stage_);
  if (session.latest()) draw_force(*session.latest(), view, *stage_);
  smooth_edges(*stage_, target);
  overlay_.draw(figures, target);
}

void Picture::draw_backdrop(const RenderTarget& target) {
  constexpr float kFarthest = 1.0F;
  target.bind();
  glClearNamedFramebufferfv(target.framebuffer(), GL_DEPTH, 0, &kFarthest);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  backdrop_.use();
  glBindVertexArray(no_vertices_.id());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

void Picture::smooth_edges(const RenderTarget& from, const RenderTarget& to) {
  to.bind();
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glBindTextureUnit(0, from.colour_texture());
  smooth_.set("u_picture", 0);
  smooth_.use();
  glBindVertexArray(no_vertices_.id());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

void Picture::draw_tool(const TickRecord& record, const View& view, const RenderTarget& target) {
  if (record.active_tool >= tools_.size()) return;
  const auto& q = record.orientation;
  painter_.draw(tools_[record.active_tool],
                rigid(vec3(record.position_mm), {q[0], q[1], q[2], q[3]}), kSteel, view, target);
}

void Picture::draw_force(const TickRecord& record, const View& view, const RenderTarget& target) {
  const glm::dvec3 force_n = vec3(record.commanded_force_n);
  const double strength_n = glm::length(force_n);
  if (strength_n < kLeastArrowN) return;
  // From the surface of the head outwards: inside it a small force would not be seen.
  const double head_mm =
      record.active_tool < tools_.size() ? scene_.tools[record.active_tool].radius_mm : 0.0;
  painter_.draw_arrow(vec3(record.position_mm) + force_n * (head_mm / strength_n),
                      force_n * (kArrowRadiiPerN * radius_mm_), kArrowThickness * radius_mm_,
                      kForce, view, target);
}

OverlayFigures overlay_figures(const Session& session) {
  OverlayFigures figures;
  if (const auto& record = session.latest()) {
    figures.force_n = glm::length(vec3(record->commanded_force_n));
    if (record->active_tool < session.scene().tools.size()) {
      figures.tool = session.scene().tools[record->active_tool].name;
    }
  }
  figures.removed_mm3 = session.removed_mm3();
  figures.removed_is_partial = session.joined_late();
  figures.tick_rate_hz = session.tick_rate_hz();
  figures.data_age_ms = session.data_age_ms();
  if (session.ended()) {
    figures.banner = session.ended_cleanly() ? "the controller has ended: this is the final state"
                                             : "the controller is gone: this is its last state";
    figures.data_age_ms.reset();
  } else if (figures.data_age_ms && *figures.data_age_ms > kStaleMs) {
    figures.banner = "stale: no news from the servo";
  }
  return figures;
}

}  // namespace kerf
