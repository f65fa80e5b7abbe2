// SPDX-License-Identifier: Apache-2.0
#include "visualizer/scene_painter.hpp"

#include "visualizer/screen_bounds.hpp"

namespace kerf {

ScenePainter::ScenePainter(std::string_view renderer, const SceneView& scene,
                           std::span<const VolumeContent> contents)
    : volumes_(scene.volumes),
      stale_(scene.volumes.size()),
      hand_(scene, scene.main_volume().radius_mm()) {
  if (!scene.voxel_tool) {
    renderer_ = make_renderer(renderer, scene, contents);
    return;
  }
  tool_.emplace(scene);
  std::vector<VolumeContent> all(contents.begin(), contents.end());
  all.push_back(tool_->content());
  renderer_ = make_renderer(renderer, tool_->added_to(scene), all);
}

void ScenePainter::set_opacities(const SceneView& scene, std::span<const VolumeContent> contents) {
  std::vector<VolumeContent> all(contents.begin(), contents.end());
  if (tool_) all.push_back(tool_->content());
  renderer_->set_opacities(tool_ ? tool_->added_to(scene).materials : scene.materials, all);
}

void ScenePainter::update(std::size_t volume, const VolumeSnapshot& snapshot) {
  renderer_->update(volume, snapshot.density, snapshot.changed);
  stale_[volume].add(*renderer_, volume, snapshot.differs);
}

void ScenePainter::hold_tool(const Hand& hand) {
  const std::size_t last = volumes_.size();
  if (tool_->take(hand.tool)) renderer_->update(last, tool_->content().density, tool_->bricks());
  renderer_->place(last, tool_->world_from_voxel(hand));
}

void ScenePainter::draw_volumes(const std::optional<Hand>& hand, const View& view,
                                const RenderTarget& target) {
  if (hand && tool_) hold_tool(*hand);
  if (hand && !tool_ && renderer_->translucent()) hand_.draw_tool(*hand, view, target);
  target.bind();
  renderer_->draw(view, target);
}

void ScenePainter::draw_over(const Hand& hand, const View& view, const RenderTarget& target) {
  if (!hand_is_among_volumes()) hand_.draw_tool(hand, view, target);
  hand_.draw_force(hand, view, target);
}

std::vector<PixelRect> ScenePainter::bounds(const Hand& hand, const View& view,
                                            PictureSize size) const {
  std::vector<PixelRect> bounds = hand_.bounds(hand, view, size);
  const auto corners = tool_ ? tool_->corners(hand) : std::nullopt;
  if (corners) bounds.push_back(screen_bounds(*corners, view, size));
  return bounds;
}

void ScenePainter::mark_volumes(StaleTiles& tiles, std::span<const VolumeContent> contents,
                                const View& view, const RenderTarget& kept) const {
  for (std::size_t v = 0; v < volumes_.size(); ++v) {
    stale_[v].mark(tiles, *renderer_, volumes_[v], contents[v].density, view, kept);
  }
}

void ScenePainter::forget_changes() {
  for (StaleVolume& volume : stale_) volume.clear();
}

}  // namespace kerf
