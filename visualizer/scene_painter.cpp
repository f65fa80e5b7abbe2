// SPDX-License-Identifier: Apache-2.0
#include "visualizer/scene_painter.hpp"

namespace kerf {

ScenePainter::ScenePainter(std::string_view renderer, const SceneView& scene,
                           std::span<const VolumeContent> contents)
    : volumes_(scene.volumes),
      renderer_(make_renderer(renderer, scene, contents)),
      stale_(scene.volumes.size()),
      hand_(scene, scene.main_volume().radius_mm()) {}

void ScenePainter::update(std::size_t volume, const VolumeSnapshot& snapshot) {
  renderer_->update(volume, snapshot.density, snapshot.changed);
  stale_[volume].add(*renderer_, volume, snapshot.differs);
}

void ScenePainter::draw_volumes(const std::optional<Hand>& hand, const View& view,
                                const RenderTarget& target) {
  if (hand && renderer_->translucent()) hand_.draw_tool(*hand, view, target);
  target.bind();
  renderer_->draw(view, target);
}

void ScenePainter::draw_over(const Hand& hand, const View& view, const RenderTarget& target) {
  if (!renderer_->translucent()) hand_.draw_tool(hand, view, target);
  hand_.draw_force(hand, view, target);
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
