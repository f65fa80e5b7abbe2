// SPDX-License-Identifier: Apache-2.0

#include "visualizer/compose/picture_layers.hpp"

#include <algorithm>
#include <array>

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
    : volumes_(scene.volumes), hand_(scene, scene.main_volume().radius_mm()) {
  std::vector<std::string> kinds = renderer_of_each(choice, volumes_.size());
  if (scene.voxel_tool) {
    SceneView before = scene;  // with the tools of the arms before
    for (std::size_t arm = 0; arm < scene.arms; ++arm) {
      tools_.emplace_back(before);
      before = tools_.back().added_to(before);
      kinds.push_back(kinds.front());
    }
  }
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
  const SceneView whole = with_tools(scene);
  const std::vector<VolumeContent> all = with_tools(contents);
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    Group& group = groups_[g];
    SceneView part = whole;
    part.volumes = picked(std::span<const VolumeView>(whole.volumes), group.volumes);
    group.renderer = make_renderer(group_kinds[g], part,
                                   picked(std::span<const VolumeContent>(all), group.volumes));
  }
}

std::vector<VolumeContent> ScenePainter::with_tools(std::span<const VolumeContent> contents) const {
  std::vector<VolumeContent> all(contents.begin(), contents.end());
  for (const ToolVolume& tool : tools_) all.push_back(tool.content());
  return all;
}

SceneView ScenePainter::with_tools(const SceneView& scene) const {
  SceneView whole = scene;
  for (const ToolVolume& tool : tools_) whole = tool.added_to(whole);
  return whole;
}

void ScenePainter::set_opacities(const SceneView& scene, std::span<const VolumeContent> contents) {
  const std::vector<VolumeContent> all = with_tools(contents);
  const auto materials = with_tools(scene).materials;
  for (const Group& group : groups_) {
    group.renderer->set_opacities(materials,
                                  picked(std::span<const VolumeContent>(all), group.volumes));
  }
}

void ScenePainter::set_cut_open(bool open, std::span<const VolumeContent> contents) {
  const std::vector<VolumeContent> all = with_tools(contents);
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

void ScenePainter::hold(const Hands& hands) {
  for (std::size_t arm = 0; arm < tools_.size(); ++arm) {
    if (!hands[arm]) continue;
    ToolVolume& tool = tools_[arm];
    Renderer& renderer = renderer_of(volumes_.size() + arm);
    const std::size_t index = indices_[volumes_.size() + arm].index;
    if (const ChangedBricks changed = tool.take(hands[arm]->tool); !changed.empty()) {
      renderer.update(index, tool.content().density, changed);
    }
    renderer.set_transform(index, tool.world_from_voxel(*hands[arm]));
  }
}

void ScenePainter::draw_volumes(Layer layer, const View& view, const RenderTarget& target) {
  for (const Group& group : groups_) {
    if (layer_of(*group.renderer) != layer) continue;
    target.bind();
    group.renderer->draw(view, target);
  }
}

void ScenePainter::draw_tool(const Hand& hand, const View& view, const RenderTarget& target) {
  if (tools_.empty()) hand_.draw_tool(hand, view, target);
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
  return !tools_.empty() && layer_of(renderer_of(volumes_.size())) == Layer::opaque;
}

std::vector<PixelRect> ScenePainter::bounds(const Hand& hand, const View& view,
                                            PictureSize size) const {
  std::vector<PixelRect> bounds = hand_.bounds(hand, view, size);
  const auto corners = tools_.empty() ? std::nullopt : tools_.front().corners(hand);  // of any arm
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

bool have_moved(const Hands& from, const Hands& to) {
  return !std::equal(from.begin(), from.end(), to.begin(), [](const auto& a, const auto& b) {
    return a && b ? a->rests_at(*b) : a.has_value() == b.has_value();
  });
}

RedrawTiles tiles_in(std::span<const PixelRect> parts, PictureSize size) {
  RedrawTiles tiles(size);
  for (const PixelRect& part : parts) tiles.mark(part);
  return tiles;
}

/// With which `pixels` take at most half the budget, as far as that goes.
int coarse_edge(double pixels, double most_pixels) {
  int edge = 2;
  while (edge < PictureLayers::kCoarsest && pixels / (edge * edge) > 0.5 * most_pixels) edge *= 2;
  return edge;
}

}  // namespace

PictureLayers::Redraw PictureLayers::redraw(const View& view, const Hands& hands,
                                            const ScenePainter& painter, double most_pixels) const {
  constexpr double kLeastProgress = 0.25;  // of the budget
  const PictureSize size = composite_.size();
  const PixelRect all = composite_.all();
  // A frame costs something whatever it draws: fewer pixels would take longer for all of them.
  most_pixels = std::max(most_pixels, static_cast<double>(all.area()) / (kCoarsest * kCoarsest));
  const bool view_changed = shown_ && shown_->view != view;
  const bool anew = !shown_ || view_changed;
  const FrameState now{view, view_changed || (shown_ && have_moved(shown_->hands, hands)), hands};
  RedrawTiles opaque(size), composite(size), late = later_;
  if (anew) {
    for (RedrawTiles* const tiles : {&opaque, &composite, &late}) tiles->mark(all);
  } else {
    RedrawTiles of_hands(size);
    for (std::size_t arm = 0; arm < hands.size(); ++arm) {
      if (hands[arm] == shown_->hands[arm]) continue;
      for (const auto& one : {hands[arm], shown_->hands[arm]}) {
        if (!one) continue;
        for (const PixelRect& part : painter.bounds(*one, view, size)) of_hands.mark(part);
      }
    }
    painter.mark_redraw(Layer::opaque, opaque, view, opaque_);
    if (painter.hand_is_opaque_volume()) opaque.mark(of_hands);
    composite = opaque;
    painter.mark_redraw(Layer::translucent, composite, view, opaque_);
    composite.mark(of_hands);
  }
  opaque.mark(composite.common(late));
  const bool translucent = painter.any(Layer::translucent);
  const RedrawTiles changed = translucent ? composite : opaque;  // those that cost volumes
  double left = most_pixels - changed.pixels(), coarse_pixels = 0.0;
  RedrawTiles coarse(size);
  int edge = 1;
  if (left < 0.0) {
    coarse = changed;
    edge = coarse_edge(changed.pixels(), most_pixels);
    coarse_pixels = changed.pixels() / (edge * edge);
    composite = composite.without(coarse);
    opaque = opaque.without(coarse);
    left = anew ? 0.0 : most_pixels - coarse_pixels;  // of a view that moves nothing is kept
  }
  if (!anew) {
    left = std::max(left, kLeastProgress * most_pixels);
    RedrawTiles resting = late;
    if (!now.moving) resting.mark(moved_);
    resting = resting.without(changed);
    const RedrawTiles first = resting.take(left);
    RedrawTiles moving = coarse;
    const RedrawTiles then = moving.take(left - first.pixels());
    composite.mark(first);
    composite.mark(then);
  }
  const std::vector<PixelRect> fine = composite.rects();  // a few tiles more
  const RedrawTiles finished = tiles_in(fine, size);
  const std::vector<PixelRect> coarsely = coarse.without(finished).rects();
  late.mark(tiles_in(coarsely, size));
  for (const RedrawTiles& stale : {coarse, late}) opaque.mark(finished.common(stale));
  const std::vector<PixelRect> of_opaque = opaque.rects();
  const double pixels = coarse_pixels + (translucent ? finished : opaque).pixels();
  return {now, coarsely, edge, of_opaque, fine, late.without(finished), pixels};
}

std::vector<PixelRect> PictureLayers::draw(const Redraw& redraw, ScenePainter& painter,
                                           ScreenPasses& passes) {
  const FrameState& now = redraw.now;
  shown_ = now;
  later_ = redraw.later;
  if (redraw.empty()) return {};
  painter.set_moving(now.moving);
  const RedrawTiles drawn = tiles_in(redraw.composite, composite_.size());
  if (!now.moving) {
    moved_ = moved_.without(drawn);
  } else if (painter.any(&Renderer::coarse_while_moving)) {
    moved_.mark(drawn);
  }
  painter.hold(now.hands);
  draw_coarse(redraw, painter, passes);
  draw_opaque(now, redraw.opaque, painter, passes);
  draw_composite(now, redraw.composite, painter);
  std::vector<PixelRect> seen;
  for (const PixelRect& part : redraw.composite) {
    seen.push_back(part.grown(ScreenPasses::kSmoothingReach));
  }
  smooth_.restrict_to(seen);
  passes.smooth_edges(composite_, smooth_);
  seen.insert(seen.end(), redraw.coarse.begin(), redraw.coarse.end());
  return seen;
}

void PictureLayers::draw_coarse(const Redraw& redraw, ScenePainter& painter, ScreenPasses& passes) {
  if (redraw.coarse.empty()) return;
  const PictureSize size = composite_.size();
  const int edge = redraw.coarse_edge;
  const PictureSize small{(size.width + edge - 1) / edge, (size.height + edge - 1) / edge};
  if (!small_ || small_->composite_.size() != small) {
    small_ = std::make_unique<PictureLayers>(small);
  }
  RedrawTiles tiles(small);
  for (const PixelRect& part : redraw.coarse) {
    const PixelRect within{part.x0 / edge, part.y0 / edge, part.x1 / edge + 1, part.y1 / edge + 1};
    tiles.mark(within.grown(1));  // enlarging reads one beyond
  }
  const std::vector<PixelRect> parts = tiles.rects();
  small_->draw_opaque(redraw.now, parts, painter, passes);
  small_->draw_composite(redraw.now, parts, painter);
  // Smoothing reads beyond what is drawn finely later.
  for (const RenderTarget* to : {&composite_, &smooth_}) {
    to->enlarge(small_->composite_, redraw.coarse);
  }
}

void PictureLayers::draw_opaque(const FrameState& now, std::span<const PixelRect> parts,
                                ScenePainter& painter, ScreenPasses& passes) {
  if (parts.empty()) return;
  opaque_.restrict_to(parts);
  passes.draw_backdrop(opaque_);
  painter.draw_volumes(Layer::opaque, now.view, opaque_);
}

void PictureLayers::draw_composite(const FrameState& now, std::span<const PixelRect> parts,
                                   ScenePainter& painter) {
  if (parts.empty()) return;
  composite_.restrict_to(parts);
  for (const PixelRect& part : parts) composite_.copy(opaque_, part);
  const auto& [view, moving, hands] = now;
  std::array<std::vector<PixelRect>, kMaxArms> of_hand;  // a mesh costs its vertices for each part
  for (std::size_t arm = 0; arm < hands.size(); ++arm) {
    if (!hands[arm]) continue;
    of_hand[arm] = clipped(parts, united(painter.bounds(*hands[arm], view, composite_.size())));
    composite_.restrict_to(of_hand[arm]);
    painter.draw_tool(*hands[arm], view, composite_);
  }
  composite_.restrict_to(parts);
  painter.draw_volumes(Layer::translucent, view, composite_);
  for (std::size_t arm = 0; arm < hands.size(); ++arm) {
    if (!hands[arm]) continue;
    composite_.restrict_to(of_hand[arm]);
    painter.draw_force(*hands[arm], view, composite_);
  }
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
