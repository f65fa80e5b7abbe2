// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "visualizer/render/renderer.hpp"

namespace kerf {

/// The volumes of a scene, each drawn by the renderer that was chosen for it. Those with the same
/// choice share one, which lets them mix where they intersect; across renderers the depth that all
/// of them write and test tells what is before what. See `Renderer` for what the calls do.
class VolumeRenderers {
 public:
  /// Opaque volumes lie under what moves among them, translucent ones over it.
  enum class Layer : std::uint8_t { opaque, translucent };

  /// `kinds` has one for each volume. Throws VisualizerError where one cannot show its volumes.
  VolumeRenderers(std::span<const std::string> kinds, const SceneView& scene,
                  std::span<const VolumeContent> contents);

  void set_opacities(std::span<const MaterialView> materials,
                     std::span<const VolumeContent> contents);
  void set_cut_open(bool open, std::span<const VolumeContent> contents);
  void set_moving(bool moving);
  void draw(Layer layer, const View& view, const RenderTarget& target);

  [[nodiscard]] bool any(Layer layer) const;
  /// Whether a renderer has this, such as `&Renderer::takes_gradient`.
  using Trait = bool (Renderer::*)() const noexcept;
  [[nodiscard]] bool any(Trait trait) const;
  [[nodiscard]] Layer layer_of(std::size_t volume) const;

  /// A renderer, and which of its own volumes is meant.
  struct Drawn {
    Renderer& renderer;
    std::size_t index;
  };
  [[nodiscard]] Drawn of(std::size_t volume) const;

 private:
  struct Group {
    std::unique_ptr<Renderer> renderer;
    std::vector<std::size_t> volumes;
  };
  struct Place {
    std::size_t group, index;
  };

  std::vector<Group> groups_;
  std::vector<Place> places_;  ///< by volume
};

}  // namespace kerf
