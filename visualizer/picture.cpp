// SPDX-License-Identifier: Apache-2.0
#include "visualizer/picture.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "visualizer/gl/context.hpp"
#include "visualizer/screen_bounds.hpp"

namespace kerf {

namespace {

constexpr double kStaleMs = 100.0;  // a servo that is alive beats each tick
constexpr double kToolRoom = 1.5;   // radii around the volumes in which the tool is never clipped
glm::dvec3 vec3(const float (&v)[3]) {
  return {v[0], v[1], v[2]};
}

/// Half the diagonal of its box.
double size_of(const VolumeView& volume) {
  const BoxCorners box = volume.corners();
  return 0.5 * glm::length(box.back() - box.front());
}

}  // namespace

Picture::Picture(const Session& session, const Look& look, double aspect)
    : scene_(session.scene()),
      look_(look),
      renderer_(renderer_for(session, look)),
      stale_(scene_.volumes.size()),
      hand_painter_(scene_, size_of(scene_.main_volume())) {
  const BoxCorners box = scene_.main_volume().corners();
  centre_mm_ = 0.5 * (box.front() + box.back());
  radius_mm_ = size_of(scene_.main_volume());
  low_mm_ = high_mm_ = centre_mm_;
  for (const VolumeView& volume : scene_.volumes) {
    for (const glm::dvec3& corner : volume.corners()) {
      low_mm_ = glm::min(low_mm_, corner);
      high_mm_ = glm::max(high_mm_, corner);
      reach_mm_ = std::max(reach_mm_, glm::length(corner - centre_mm_));
    }
  }
  for (const VolumeView& volume : scene_.volumes) bricks_uploaded_ += volume.bricks.count();
  reset_camera(aspect);
}

std::unique_ptr<Renderer> Picture::renderer_for(const Session& session, const Look& look) {
  SceneView scene = scene_;
  for (VolumeView& volume : scene.volumes) {
    if (look.iso) volume.iso = static_cast<Density>(std::lround(*look.iso * kDensityMax));
  }
  return make_renderer(look.renderer, scene, session.contents());
}

void Picture::set_look(const Session& session, const Look& look) {
  if (look == look_) return;
  if (look.renderer != look_.renderer || look.iso != look_.iso) {
    renderer_ = renderer_for(session, look);
    for (const VolumeView& volume : scene_.volumes) bricks_uploaded_ += volume.bricks.count();
  }
  look_ = look;
  redraw_all();
}

LookControls Picture::controls() const {
  return {.look = look_,
          .own_iso = scene_.main_volume().iso / kDensityMax,
          .clips = renderer_->clips()};
}

glm::dvec4 Picture::shown_half() const {
  const ClipPlane& clip = look_.clip;
  if (!clip.on) return View{}.shown;
  glm::dvec4 shown(0.0);
  shown[clip.axis] = -1.0;
  shown.w = glm::mix(low_mm_, high_mm_, clip.at)[clip.axis];
  return shown;
}

void Picture::reset_camera(double aspect) {
  camera_.frame(scene_.main_volume().corners(), aspect);
}

void Picture::update(const Session& session) {
  for (std::size_t v = 0; v < scene_.volumes.size(); ++v) {
    const VolumeSnapshot& snapshot = session.snapshot(v);
    renderer_->update(v, snapshot.density, snapshot.changed);
    bricks_uploaded_ += snapshot.changed.size();
    stale_[v].add(*renderer_, v, snapshot.differs);
  }
}

Redrawn Picture::draw(const Session& session, const OverlayFigures& figures,
                      const RenderTarget& target) {
  const PictureSize size = target.size();
  const double aspect = static_cast<double>(size.width) / size.height;
  View view = camera_.view(aspect, reach_mm_ + kToolRoom * radius_mm_);
  view.shown = shown_half();
  std::optional<Hand> hand;
  if (session.latest()) hand = hand_of(*session.latest());

  const bool fresh = !layers_ || layers_->stage.size() != size;
  if (fresh) layers_.emplace(size);
  std::vector<PixelRect> volumes{target.all()}, stage{target.all()};
  const bool moving = !fresh && view != shown_.view;
  const bool settles = shown_.moving && !moving;  // drawn coarsely until now
  if (!fresh && !moving && !settles) {
    StaleTiles tiles(size);
    mark_volumes(tiles, session, view);
    volumes = tiles.rects();
    mark_hand(tiles, hand, view, size);
    stage = tiles.rects();
    if (renderer_->translucent()) volumes = stage;  // the hand is under them
  }
  const OverlayFigures panel = figures.rounded();
  const bool same_target = !fresh && target.framebuffer() == shown_.target;
  const bool same_panel = panel == shown_.figures && same_target;
  for (StaleVolume& volume : stale_) volume.clear();
  if (stage.empty() && same_panel) return {};

  renderer_->set_moving(moving);
  std::vector<PixelRect> others;
  if (!stage.empty()) others = draw_layers(hand, view, volumes, stage);
  const PixelRect panels = overlay_.prepare(panel, size);
  if (same_target) {
    others.push_back(panels.united(shown_.panels));  // they let the picture shine through
  } else {
    others = {target.all()};
  }
  for (const PixelRect& part : others) target.copy_colour(layers_->smooth, part);
  overlay_.draw(target);
  glDisable(GL_SCISSOR_TEST);
  shown_ = {view, moving, hand, panel, target.framebuffer(), panels};
  double drawn = 0.0;
  for (const PixelRect& part : volumes) drawn += part.area();
  return {true, drawn / target.all().area()};
}

void Picture::mark_volumes(StaleTiles& tiles, const Session& session, const View& view) const {
  for (std::size_t v = 0; v < scene_.volumes.size(); ++v) {
    stale_[v].mark(tiles, *renderer_, scene_.volumes[v], session.snapshot(v).density, view,
                   layers_->volumes);
  }
}

void Picture::mark_hand(StaleTiles& tiles, const std::optional<Hand>& hand, const View& view,
                        PictureSize size) const {
  if (hand == shown_.hand) return;
  for (const auto& one : {hand, shown_.hand}) {
    if (one) tiles.mark(hand_painter_.bounds(*one, view, size));
  }
}

std::vector<PixelRect> Picture::draw_layers(const std::optional<Hand>& hand, const View& view,
                                            std::span<const PixelRect> volumes,
                                            std::span<const PixelRect> stage) {
  const bool tool_first = renderer_->translucent();  // it shines through them
  if (!volumes.empty()) {
    layers_->volumes.restrict_to(volumes);
    draw_backdrop(layers_->volumes);
    if (hand && tool_first) hand_painter_.draw_tool(*hand, view, layers_->volumes);
    layers_->volumes.bind();
    renderer_->draw(view, layers_->volumes);
  }
  layers_->stage.restrict_to(stage);
  for (const PixelRect& part : stage) layers_->stage.copy(layers_->volumes, part);
  if (hand && !tool_first) hand_painter_.draw_tool(*hand, view, layers_->stage);
  if (hand) hand_painter_.draw_force(*hand, view, layers_->stage);
  constexpr int kSmoothingReach = 3;  // pixels
  std::vector<PixelRect> smoothed;
  for (const PixelRect& part : stage) smoothed.push_back(part.grown(kSmoothingReach));
  layers_->smooth.restrict_to(smoothed);
  smooth_edges(layers_->stage, layers_->smooth);
  return smoothed;
}

void Picture::draw_backdrop(const RenderTarget& target) {
  target.bind();
  // Its depth is that of the far plane, whatever was there.
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_ALWAYS);
  glDisable(GL_BLEND);
  backdrop_.use();
  glBindVertexArray(no_vertices_.id());
  target.for_parts([] { glDrawArrays(GL_TRIANGLES, 0, 3); });
  glDepthFunc(GL_LESS);
}

void Picture::smooth_edges(const RenderTarget& from, const RenderTarget& to) {
  to.bind();
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glBindTextureUnit(0, from.colour_texture());
  smooth_.set("u_picture", 0);
  smooth_.use();
  glBindVertexArray(no_vertices_.id());
  to.for_parts([] { glDrawArrays(GL_TRIANGLES, 0, 3); });
}

Redrawn draw_measured(Picture& picture, Session& session, const OverlayFigures& figures,
                      const RenderTarget& target, FrameReport& report) {
  const Stopwatch watch;
  const auto removal = session.take_oldest_removal();
  const Redrawn redrawn = picture.draw(session, figures, target);
  if (!redrawn.any) {
    ++report.rest_frames;
    return redrawn;
  }
  glFinish();
  throw_if_context_is_lost();
  report.wall_ms.push_back(watch.wall_ms());
  report.cpu_ms.push_back(watch.cpu_ms());
  report.redrawn.push_back(redrawn.share);
  if (removal && redrawn.share > 0.0) {
    const auto since = std::chrono::steady_clock::now() - *removal;
    report.latency_ms.push_back(std::chrono::duration<double, std::milli>(since).count());
  }
  return redrawn;
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
