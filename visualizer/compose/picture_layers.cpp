// SPDX-License-Identifier: Apache-2.0

#include "visualizer/compose/picture_layers.hpp"

#include <algorithm>

#include "visualizer/render/renderer.hpp"
#include "visualizer/scene/camera.hpp"

namespace kerf {

namespace {

using Layer = VolumeRenderers::Layer;

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

VolumeRenderers::VolumeRenderers(std::span<const std::string> kinds, const SceneView& scene,
                                 std::span<const VolumeContent> contents) {
  std::vector<std::string> group_kinds;
  for (const std::string& kind : kinds) {
    const auto found = std::find(group_kinds.begin(), group_kinds.end(), kind);
    const auto group = static_cast<std::size_t>(found - group_kinds.begin());
    if (found == group_kinds.end()) {
      group_kinds.push_back(kind);
      groups_.emplace_back();
    }
    groups_[group].volumes.push_back(places_.size());
    places_.push_back({group, groups_[group].volumes.size() - 1});
  }
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    Group& group = groups_[g];
    SceneView part = scene;
    part.volumes = picked(std::span<const VolumeView>(scene.volumes), group.volumes);
    group.renderer = make_renderer(group_kinds[g], part, picked(contents, group.volumes));
  }
}

void VolumeRenderers::set_opacities(std::span<const MaterialView> materials,
                                    std::span<const VolumeContent> contents) {
  for (const Group& group : groups_) {
    group.renderer->set_opacities(materials, picked(contents, group.volumes));
  }
}

void VolumeRenderers::set_cut_open(bool open, std::span<const VolumeContent> contents) {
  for (const Group& group : groups_) {
    group.renderer->set_cut_open(open, picked(contents, group.volumes));
  }
}

void VolumeRenderers::set_moving(bool moving) {
  for (const Group& group : groups_) group.renderer->set_moving(moving);
}

void VolumeRenderers::draw(Layer layer, const View& view, const RenderTarget& target) {
  for (const Group& group : groups_) {
    if (kerf::layer_of(*group.renderer) != layer) continue;
    target.bind();
    group.renderer->draw(view, target);
  }
}

bool VolumeRenderers::any(Layer layer) const {
  return std::any_of(groups_.begin(), groups_.end(),
                     [&](const Group& group) { return kerf::layer_of(*group.renderer) == layer; });
}

bool VolumeRenderers::any(Trait trait) const {
  return std::any_of(groups_.begin(), groups_.end(),
                     [&](const Group& group) { return (*group.renderer.*trait)(); });
}

Layer VolumeRenderers::layer_of(std::size_t volume) const {
  return kerf::layer_of(of(volume).renderer);
}

VolumeRenderers::Drawn VolumeRenderers::of(std::size_t volume) const {
  const auto& [group, index] = places_[volume];
  return {*groups_[group].renderer, index};
}

ScenePainter::ScenePainter(const std::string& renderers, const SceneView& scene,
                           std::span<const VolumeContent> contents)
    : volumes_(scene.volumes),
      tool_(scene.voxel_tool ? std::optional<ToolVolume>(scene) : std::nullopt),
      renderers_(made(renderers, scene, contents)),
      stale_(scene.volumes.size()),
      hand_(scene, scene.main_volume().radius_mm()) {}

VolumeRenderers ScenePainter::made(const std::string& renderers, const SceneView& scene,
                                   std::span<const VolumeContent> contents) const {
  std::vector<std::string> kinds = renderer_of_each(renderers, volumes_.size());
  if (!tool_) return {kinds, scene, contents};
  kinds.push_back(kinds.front());
  return {kinds, tool_->added_to(scene), with_tool(contents)};
}

std::vector<VolumeContent> ScenePainter::with_tool(std::span<const VolumeContent> contents) const {
  std::vector<VolumeContent> all(contents.begin(), contents.end());
  if (tool_) all.push_back(tool_->content());
  return all;
}

void ScenePainter::set_opacities(const SceneView& scene, std::span<const VolumeContent> contents) {
  renderers_.set_opacities(tool_ ? tool_->added_to(scene).materials : scene.materials,
                           with_tool(contents));
}

void ScenePainter::set_cut_open(bool open, std::span<const VolumeContent> contents) {
  renderers_.set_cut_open(open, with_tool(contents));
}

void ScenePainter::update(std::size_t volume, const VolumeSnapshot& snapshot) {
  const auto [renderer, index] = renderers_.of(volume);
  renderer.update(index, snapshot.density, snapshot.changed);
  stale_[volume].add(renderer, index, snapshot.differs);
}

void ScenePainter::hold(const Hand& hand) {
  if (!tool_) return;
  const auto [renderer, last] = renderers_.of(volumes_.size());
  if (tool_->take(hand.tool)) renderer.update(last, tool_->content().density, tool_->bricks());
  renderer.place(last, tool_->world_from_voxel(hand));
}

void ScenePainter::draw_tool(const Hand& hand, const View& view, const RenderTarget& target) {
  if (!tool_) hand_.draw_tool(hand, view, target);
}

std::vector<PixelRect> ScenePainter::bounds(const Hand& hand, const View& view,
                                            PictureSize size) const {
  std::vector<PixelRect> bounds = hand_.bounds(hand, view, size);
  const auto corners = tool_ ? tool_->corners(hand) : std::nullopt;
  if (corners) bounds.push_back(screen_bounds(*corners, view, size));
  return bounds;
}

void ScenePainter::mark_volumes(Layer layer, RedrawTiles& tiles,
                                std::span<const VolumeContent> contents, const View& view,
                                const RenderTarget& kept) const {
  for (std::size_t v = 0; v < volumes_.size(); ++v) {
    if (renderers_.layer_of(v) != layer) continue;
    stale_[v].mark(tiles, renderers_.of(v).renderer, volumes_[v], contents[v].density, view, kept);
  }
}

void ScenePainter::forget_changes() {
  for (StaleVolume& volume : stale_) volume.clear();
}

namespace {

bool has_moved(const std::optional<Hand>& from, const std::optional<Hand>& to) {
  return from && to ? !from->rests_at(*to) : from.has_value() != to.has_value();
}

}  // namespace

PictureLayers::Stale PictureLayers::stale(const View& view, const std::optional<Hand>& hand,
                                          const ScenePainter& painter,
                                          std::span<const VolumeContent> contents) const {
  const PixelRect all = stage_.all();
  const bool turned = shown_ && shown_->view != view;
  const Moment now{view, turned || (shown_ && has_moved(shown_->hand, hand)), hand};
  if (!shown_ || turned) return {now, {all}, {all}};
  RedrawTiles of_hand(stage_.size());
  if (hand != shown_->hand) {
    for (const auto& one : {hand, shown_->hand}) {
      if (!one) continue;
      for (const PixelRect& part : painter.bounds(*one, view, stage_.size())) of_hand.mark(part);
    }
  }
  RedrawTiles tiles(stage_.size());
  painter.mark_volumes(Layer::opaque, tiles, contents, view, opaque_);
  if (painter.hand_is_opaque_volume()) tiles.mark(of_hand);
  const std::vector<PixelRect> opaque = tiles.rects();
  painter.mark_volumes(Layer::translucent, tiles, contents, view, opaque_);
  tiles.mark(of_hand);
  if (!now.moving) tiles.mark(coarse_);
  return {now, opaque, tiles.rects()};
}

std::vector<PixelRect> PictureLayers::draw(const Stale& stale, ScenePainter& painter,
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

void PictureLayers::draw_opaque(const Stale& stale, ScenePainter& painter, ScreenPasses& passes) {
  if (stale.opaque.empty()) return;
  opaque_.restrict_to(stale.opaque);
  passes.draw_backdrop(opaque_);
  painter.draw_volumes(Layer::opaque, stale.now.view, opaque_);
}

void PictureLayers::draw_stage(const Stale& stale, ScenePainter& painter) {
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
