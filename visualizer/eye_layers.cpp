// SPDX-License-Identifier: Apache-2.0
#include "visualizer/eye_layers.hpp"

namespace kerf {

EyeLayers::Stale EyeLayers::stale(const View& view, const std::optional<Hand>& hand,
                                  const ScenePainter& painter,
                                  std::span<const VolumeContent> contents) const {
  const PixelRect all = stage_.all();
  const bool moving = shown_ && shown_->view != view;
  const Moment now{view, moving, hand};
  // What was drawn coarsely settles when the camera does.
  if (!shown_ || moving || shown_->moving) return {now, {all}, {all}};
  StaleTiles tiles(stage_.size());
  painter.mark_volumes(tiles, contents, view, volumes_);
  std::vector<PixelRect> volumes = tiles.rects();
  if (hand != shown_->hand) {
    for (const auto& one : {hand, shown_->hand}) {
      if (!one) continue;
      for (const PixelRect& part : painter.bounds(*one, view, stage_.size())) tiles.mark(part);
    }
  }
  const std::vector<PixelRect> stage = tiles.rects();
  if (painter.hand_is_among_volumes()) volumes = stage;
  return {now, volumes, stage};
}

std::vector<PixelRect> EyeLayers::draw(const Stale& stale, ScenePainter& painter,
                                       ScreenPasses& passes) {
  shown_ = stale.now;
  if (stale.stage.empty()) return {};
  painter.renderer().set_moving(stale.now.moving);
  draw_volumes(stale, painter, passes);
  draw_stage(stale, painter);
  std::vector<PixelRect> smoothed;
  for (const PixelRect& part : stale.stage) {
    smoothed.push_back(part.grown(ScreenPasses::kSmoothingReach));
  }
  smooth_.restrict_to(smoothed);
  passes.smooth_edges(stage_, smooth_);
  return smoothed;
}

void EyeLayers::draw_volumes(const Stale& stale, ScenePainter& painter, ScreenPasses& passes) {
  if (stale.volumes.empty()) return;
  volumes_.restrict_to(stale.volumes);
  passes.draw_backdrop(volumes_);
  painter.draw_volumes(stale.now.hand, stale.now.view, volumes_);
}

void EyeLayers::draw_stage(const Stale& stale, ScenePainter& painter) {
  stage_.restrict_to(stale.stage);
  for (const PixelRect& part : stale.stage) stage_.copy(volumes_, part);
  const auto& [view, moving, hand] = stale.now;
  if (!hand) return;
  std::vector<PixelRect> of_hand;
  PixelRect bounds;
  for (const PixelRect& part : painter.bounds(*hand, view, stage_.size())) {
    bounds = bounds.united(part);
  }
  for (const PixelRect& part : stale.stage) {
    const PixelRect both = part.clipped(bounds);
    if (!both.empty()) of_hand.push_back(both);
  }
  stage_.restrict_to(of_hand);  // a mesh costs its vertices for each part
  painter.draw_over(*hand, view, stage_);
}

}  // namespace kerf
