// SPDX-License-Identifier: Apache-2.0
#include "visualizer/render/volume_renderers.hpp"

#include <algorithm>

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

}  // namespace kerf
