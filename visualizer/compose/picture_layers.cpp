// SPDX-License-Identifier: Apache-2.0

#include "visualizer/compose/picture_layers.hpp"

#include <algorithm>

#include "visualizer/render/renderer.hpp"
#include "visualizer/scene/camera.hpp"

namespace kerf {

namespace {

using Layer = ScenePainter::Layer;

Layer layer_of(const Renderer& renderer) {
  return renderer.translucent() ? Layer::translucent : Layer::opaque;
}

template <class T>
std::vector<T> picked(std::span<const T> all, std::span<const std::size_t> which) {
  std::vector<T> some;
  for (const std::size_t i : which) some.push_back(all[i]);
  return some;
}

}  // namespace

ScenePainter::ScenePainter(const std::string& choice, const SceneView& scene,
                           std::span<const VolumeContent> contents)
    : volumes_(scene.volumes),
      tool_(scene.voxel_tool ? std::optional<ToolVolume>(scene) : std::nullopt),
      hand_(scene, scene.main_volume().radius_mm()) {
  std::vector<std::string> kinds = renderer_of_each(choice, volumes_.size());
  if (tool_) kinds.push_back(kinds.front());
  std::vector<std::string> group_kinds;
  for (const std::string& kind : kinds) {
    const auto found = std::find(group_kinds.begin(), group_kinds.end(), kind);
    const auto group = static_cast<std::size_t>(found - group_kinds.begin());
    if (found == group_kinds.end()) {
      group_kinds.push_back(kind);
      groups_.emplace_back();
    }
    groups_[group].volumes.push_back(indices_.size());
    indices_.push_back({group, groups_[group].volumes.size() - 1});
  }
  const SceneView whole = tool_ ? tool_->added_to(scene) : scene;
  const std::vector<VolumeContent> all = with_tool(contents);
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    Group& group = groups_[g];
    SceneView part = whole;
    part.volumes = picked(std::span<const VolumeView>(whole.volumes), group.volumes);
    group.renderer = make_renderer(group_kinds[g], part,
                                   picked(std::span<const VolumeContent>(all), group.volumes));
  }
}

std::vector<VolumeContent> ScenePainter::with_tool(std::span<const VolumeContent> contents) const {
  std::vector<VolumeContent> all(contents.begin(), contents.end());
  if (tool_) all.push_back(tool_->content());
  return all;
}

void ScenePainter::set_opacities(const SceneView& scene, std::span<const VolumeContent> contents) {
  const std::vector<VolumeContent> all = with_tool(contents);
  const auto materials = tool_ ? tool_->added_to(scene).materials : scene.materials;
  for (const Group& group : groups_) {
    group.renderer->set_opacities(materials,
                                  picked(std::span<const VolumeContent>(all), group.volumes));
  }
}

void ScenePainter::set_cut_open(bool open, std::span<const VolumeContent> contents) {
  const std::vector<VolumeContent> all = with_tool(contents);
  for (const Group& group : groups_) {
    group.renderer->set_cut_open(open, picked(std::span<const VolumeContent>(all), group.volumes));
  }
}

void ScenePainter::set_moving(bool moving) {
  for (const Group& group : groups_) group.renderer->set_moving(moving);
}

void ScenePainter::update(std::size_t volume, const VolumeSnapshot& snapshot) {
  renderer_of(volume).update(indices_[volume].index, snapshot.density, snapshot.changed);
}

void ScenePainter::hold(const Hand& hand) {
  if (!tool_) return;
  Renderer& renderer = renderer_of(volumes_.size());
  const std::size_t index = indices_.back().index;
  if (const ChangedBricks changed = tool_->take(hand.tool); !changed.empty()) {
    renderer.update(index, tool_->content().density, changed);
  }
  renderer.set_transform(index, tool_->world_from_voxel(hand));
}

void ScenePainter::draw_volumes(Layer layer, const View& view, const RenderTarget& target) {
  for (const Group& group : groups_) {
    if (layer_of(*group.renderer) != layer) continue;
    target.bind();
    group.renderer->draw(view, target);
  }
}

void ScenePainter::draw_tool(const Hand& hand, const View& view, const RenderTarget& target) {
  if (!tool_) hand_.draw_tool(hand, view, target);
}

bool ScenePainter::any(Layer layer) const {
  return std::any_of(groups_.begin(), groups_.end(),
                     [&](const Group& group) { return layer_of(*group.renderer) == layer; });
}

bool ScenePainter::any(bool (Renderer::*property)() const noexcept) const {
  return std::any_of(groups_.begin(), groups_.end(),
                     [&](const Group& group) { return (*group.renderer.*property)(); });
}

bool ScenePainter::hand_is_opaque_volume() const {
  return tool_ && layer_of(renderer_of(volumes_.size())) == Layer::opaque;
}

std::vector<PixelRect> ScenePainter::bounds(const Hand& hand, const View& view,
                                            PictureSize size) const {
  std::vector<PixelRect> bounds = hand_.bounds(hand, view, size);
  const auto corners = tool_ ? tool_->corners(hand) : std::nullopt;
  if (corners) bounds.push_back(screen_bounds(*corners, view, size));
  return bounds;
}

void ScenePainter::mark_redraw(Layer layer, RedrawTiles& tiles, const View& view,
                               const RenderTarget& kept) const {
  for (std::size_t v = 0; v < volumes_.size(); ++v) {
    const Renderer& renderer = renderer_of(v);
    if (layer_of(renderer) != layer) continue;
    renderer.mark_redraw(indices_[v].index, {volumes_[v], view, kept}, tiles);
  }
}

void ScenePainter::forget_changes() {
  for (const Group& group : groups_) group.renderer->forget_changes();
}

namespace {

bool has_moved(const std::optional<Hand>& from, const std::optional<Hand>& to) {
  return from && to ? !from->rests_at(*to) : from.has_value() != to.has_value();
}

}  // namespace

PictureLayers::Redraw PictureLayers::redraw(const View& view, const std::optional<Hand>& hand,
                                            const ScenePainter& painter) const {
  const PixelRect all = composite_.all();
  const bool view_changed = shown_ && shown_->view != view;
  const FrameState now{view, view_changed || (shown_ && has_moved(shown_->hand, hand)), hand};
  if (!shown_ || view_changed) return {now, {all}, {all}};
  RedrawTiles of_hand(composite_.size());
  if (hand != shown_->hand) {
    for (const auto& one : {hand, shown_->hand}) {
      if (!one) continue;
      for (const PixelRect& part : painter.bounds(*one, view, composite_.size()))
        of_hand.mark(part);
    }
  }
  RedrawTiles tiles(composite_.size());
  painter.mark_redraw(Layer::opaque, tiles, view, opaque_);
  if (painter.hand_is_opaque_volume()) tiles.mark(of_hand);
  const std::vector<PixelRect> opaque = tiles.rects();
  painter.mark_redraw(Layer::translucent, tiles, view, opaque_);
  tiles.mark(of_hand);
  if (!now.moving) tiles.mark(coarse_);
  return {now, opaque, tiles.rects()};
}

std::vector<PixelRect> PictureLayers::draw(const Redraw& redraw, ScenePainter& painter,
                                           ScreenPasses& passes) {
  shown_ = redraw.now;
  if (redraw.composite.empty()) return {};
  painter.set_moving(redraw.now.moving);
  if (!redraw.now.moving) {
    coarse_.clear();
  } else if (painter.any(&Renderer::coarse_while_moving)) {
    for (const PixelRect& part : redraw.composite) coarse_.mark(part);
  }
  if (redraw.now.hand) painter.hold(*redraw.now.hand);
  draw_opaque(redraw, painter, passes);
  draw_composite(redraw, painter);
  std::vector<PixelRect> smoothed;
  for (const PixelRect& part : redraw.composite) {
    smoothed.push_back(part.grown(ScreenPasses::kSmoothingReach));
  }
  smooth_.restrict_to(smoothed);
  passes.smooth_edges(composite_, smooth_);
  return smoothed;
}

void PictureLayers::draw_opaque(const Redraw& redraw, ScenePainter& painter, ScreenPasses& passes) {
  if (redraw.opaque.empty()) return;
  opaque_.restrict_to(redraw.opaque);
  passes.draw_backdrop(opaque_);
  painter.draw_volumes(Layer::opaque, redraw.now.view, opaque_);
}

void PictureLayers::draw_composite(const Redraw& redraw, ScenePainter& painter) {
  composite_.restrict_to(redraw.composite);
  for (const PixelRect& part : redraw.composite) composite_.copy(opaque_, part);
  const auto& [view, moving, hand] = redraw.now;
  std::vector<PixelRect> of_hand;  // a mesh costs its vertices for each part
  if (hand) {
    of_hand = clipped(redraw.composite, united(painter.bounds(*hand, view, composite_.size())));
    composite_.restrict_to(of_hand);
    painter.draw_tool(*hand, view, composite_);
  }
  composite_.restrict_to(redraw.composite);
  painter.draw_volumes(Layer::translucent, view, composite_);
  if (!hand) return;
  composite_.restrict_to(of_hand);
  painter.draw_force(*hand, view, composite_);
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
