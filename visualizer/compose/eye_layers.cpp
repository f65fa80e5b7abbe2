// SPDX-License-Identifier: Apache-2.0
#include "visualizer/compose/eye_layers.hpp"

namespace kerf {

namespace {

using Layer = ScenePainter::Layer;

bool has_moved(const std::optional<Hand>& from, const std::optional<Hand>& to) {
  return from && to ? !from->rests_at(*to) : from.has_value() != to.has_value();
}

}  // namespace

EyeLayers::Stale EyeLayers::stale(const View& view, const std::optional<Hand>& hand,
                                  const ScenePainter& painter,
                                  std::span<const VolumeContent> contents) const {
  const PixelRect all = stage_.all();
  const bool turned = shown_ && shown_->view != view;
  const Moment now{view, turned || (shown_ && has_moved(shown_->hand, hand)), hand};
  if (!shown_ || turned) return {now, {all}, {all}};
  StaleTiles of_hand(stage_.size());
  if (hand != shown_->hand) {
    for (const auto& one : {hand, shown_->hand}) {
      if (!one) continue;
      for (const PixelRect& part : painter.bounds(*one, view, stage_.size())) of_hand.mark(part);
    }
  }
  StaleTiles tiles(stage_.size());
  painter.mark_volumes(Layer::opaque, tiles, contents, view, opaque_);
  if (painter.hand_is_opaque_volume()) tiles.mark(of_hand);
  const std::vector<PixelRect> opaque = tiles.rects();
  painter.mark_volumes(Layer::translucent, tiles, contents, view, opaque_);
  tiles.mark(of_hand);
  if (!now.moving) tiles.mark(coarse_);
  return {now, opaque, tiles.rects()};
}

std::vector<PixelRect> EyeLayers::draw(const Stale& stale, ScenePainter& painter,
                                       ScreenPasses& passes) {
  shown_ = stale.now;
  if (stale.stage.empty()) return {};
  painter.renderers().set_moving(stale.now.moving);
  if (!stale.now.moving) {
    coarse_.clear();
  } else if (painter.renderers().any(&Renderer::coarse_while_moving)) {
    for (const PixelRect& part : stale.stage) coarse_.mark(part);
  }
  if (stale.now.hand) painter.hold(*stale.now.hand);
  draw_opaque(stale, painter, passes);
  draw_stage(stale, painter);
  std::vector<PixelRect> smoothed;
  for (const PixelRect& part : stale.stage) {
    smoothed.push_back(part.grown(ScreenPasses::kSmoothingReach));
  }
  smooth_.restrict_to(smoothed);
  passes.smooth_edges(stage_, smooth_);
  return smoothed;
}

void EyeLayers::draw_opaque(const Stale& stale, ScenePainter& painter, ScreenPasses& passes) {
  if (stale.opaque.empty()) return;
  opaque_.restrict_to(stale.opaque);
  passes.draw_backdrop(opaque_);
  painter.draw_volumes(Layer::opaque, stale.now.view, opaque_);
}

void EyeLayers::draw_stage(const Stale& stale, ScenePainter& painter) {
  stage_.restrict_to(stale.stage);
  for (const PixelRect& part : stale.stage) stage_.copy(opaque_, part);
  const auto& [view, moving, hand] = stale.now;
  std::vector<PixelRect> of_hand;  // a mesh costs its vertices for each part
  if (hand) {
    of_hand = clipped(stale.stage, united(painter.bounds(*hand, view, stage_.size())));
    stage_.restrict_to(of_hand);
    painter.draw_tool(*hand, view, stage_);
  }
  stage_.restrict_to(stale.stage);
  painter.draw_volumes(Layer::translucent, view, stage_);
  if (!hand) return;
  stage_.restrict_to(of_hand);
  painter.draw_force(*hand, view, stage_);
}

void ScreenPasses::draw_backdrop(const RenderTarget& target) {
  target.bind();
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_ALWAYS);
  glDisable(GL_BLEND);
  backdrop_.use();
  target.cover();
  glDepthFunc(GL_LESS);
}

void ScreenPasses::smooth_edges(const RenderTarget& from, const RenderTarget& to) {
  to.bind();
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glBindTextureUnit(0, from.colour_texture());
  smooth_.set("u_picture", 0);
  smooth_.use();
  to.cover();
}

}  // namespace kerf
