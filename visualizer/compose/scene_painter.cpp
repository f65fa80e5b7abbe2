// SPDX-License-Identifier: Apache-2.0
#include "visualizer/compose/scene_painter.hpp"

#include "visualizer/render/renderer_choice.hpp"
#include "visualizer/view/camera.hpp"

namespace kerf {

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

void ScenePainter::mark_volumes(Layer layer, StaleTiles& tiles,
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

}  // namespace kerf
