// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "visualizer/compose/tool_painter.hpp"
#include "visualizer/compose/tool_volume.hpp"
#include "visualizer/gl/program.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/redraw/changed_cells.hpp"
#include "visualizer/render/renderer.hpp"

namespace kerf {

/// The volumes of a scene, each drawn by the renderer that was chosen for it. Those with the same
/// choice share one, which lets them mix where they intersect; across renderers the depth that all
/// of them write and test decides what is before what. See `Renderer` for what the calls do.
class VolumeRenderers {
 public:
  /// Opaque volumes lie under what moves among them, translucent ones over it.
  enum class Layer : std::uint8_t { opaque, translucent };

  /// `kinds` has one for each volume. Throws VisualizerError if one cannot show its volumes.
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

/// Volumes and hand as the chosen renderers show them: what is drawn over what, and which tiles of
/// a picture a change of either leaves stale.
///
/// Opaque volumes come first, so that a tool which moves leaves them as they are; translucent ones
/// come after the tool, which shines through them. A tool of voxels is a volume itself, drawn as
/// the first one is.
class ScenePainter {
 public:
  using Layer = VolumeRenderers::Layer;

  /// `renderers` is a choice: renderer.hpp. Throws VisualizerError if that does not fit the scene,
  /// or a renderer cannot show its volumes.
  ScenePainter(const std::string& renderers, const SceneView& scene,
               std::span<const VolumeContent> contents);

  [[nodiscard]] VolumeRenderers& renderers() noexcept { return renderers_; }
  [[nodiscard]] const VolumeRenderers& renderers() const noexcept { return renderers_; }

  /// The scene with other opacities; `contents` are all of its volumes.
  void set_opacities(const SceneView& scene, std::span<const VolumeContent> contents);
  /// See `Renderer`; `contents` are all volumes of the scene.
  void set_cut_open(bool open, std::span<const VolumeContent> contents);
  /// What the last poll changed in a volume.
  void update(std::size_t volume, const VolumeSnapshot& snapshot);
  /// Puts a tool of voxels into the hand: before anything is drawn with it.
  void hold(const Hand& hand);

  /// Volumes, and among them a tool of voxels.
  void draw_volumes(Layer layer, const View& view, const RenderTarget& target) {
    renderers_.draw(layer, view, target);
  }
  /// The tool as a mesh: after the opaque volumes, before the others.
  void draw_tool(const Hand& hand, const View& view, const RenderTarget& target);
  /// The last of all.
  void draw_force(const Hand& hand, const View& view, const RenderTarget& target) {
    hand_.draw_force(hand, view, target);
  }
  /// A hand that moves changes what the opaque volumes are.
  [[nodiscard]] bool hand_is_opaque_volume() const {
    return tool_ && renderers_.layer_of(volumes_.size()) == Layer::opaque;
  }
  /// Rectangles of pixels that the hand may touch.
  [[nodiscard]] std::vector<PixelRect> bounds(const Hand& hand, const View& view,
                                              PictureSize size) const;

  /// Marks what changed in the volumes of a layer since `forget_changes`. `contents` are all of
  /// them as they are now; `kept` holds the opaque ones as they were drawn before, and no other.
  void mark_volumes(Layer layer, RedrawTiles& tiles, std::span<const VolumeContent> contents,
                    const View& view, const RenderTarget& kept) const;
  void forget_changes();

 private:
  /// And the tool's.
  [[nodiscard]] std::vector<VolumeContent> with_tool(std::span<const VolumeContent> contents) const;
  [[nodiscard]] VolumeRenderers made(const std::string& renderers, const SceneView& scene,
                                     std::span<const VolumeContent> contents) const;

  std::vector<VolumeView> volumes_;  ///< of the session
  std::optional<ToolVolume> tool_;
  VolumeRenderers renderers_;
  std::vector<StaleVolume> stale_;  ///< by volume
  HandPainter hand_;
};

/// What is drawn as one triangle over the whole picture, within the parts of its target.
class ScreenPasses {
 public:
  /// Colour, and the depth of the far plane, whatever was there.
  void draw_backdrop(const RenderTarget& target);

  /// Smooths the edges in `from`. A pixel depends on those up to `kSmoothingReach` away.
  static constexpr int kSmoothingReach = 3;
  void smooth_edges(const RenderTarget& from, const RenderTarget& to);

 private:
  GlProgram backdrop_{"screen.vert", "backdrop.frag"};
  GlProgram smooth_{"screen.vert", "antialias.frag"};
};

/// The picture of one eye as it grows, kept from frame to frame: backdrop and opaque volumes, over
/// them the hand and what is translucent, and all that with smoothed edges. So a hand that moves
/// over opaque volumes costs no volume.
class PictureLayers {
 public:
  /// What a picture shows beside the volumes.
  struct Moment {
    View view;
    bool moving = false;  ///< camera or tool are elsewhere than before
    std::optional<Hand> hand;
  };
  /// What must be drawn again, and with what.
  struct Stale {
    Moment now;
    std::vector<PixelRect> opaque, stage;
  };

  explicit PictureLayers(PictureSize size)
      : opaque_(size), stage_(size), smooth_(size), coarse_(size) {}

  /// What shows `view` and `hand` and the volumes, which are now `contents`.
  [[nodiscard]] Stale stale(const View& view, const std::optional<Hand>& hand,
                            const ScenePainter& painter,
                            std::span<const VolumeContent> contents) const;
  /// Draws that. Returns the parts of `seen` that are others now.
  std::vector<PixelRect> draw(const Stale& stale, ScenePainter& painter, ScreenPasses& passes);

  /// The finished picture; its depth is not used.
  [[nodiscard]] const RenderTarget& seen() const noexcept { return smooth_; }

 private:
  void draw_opaque(const Stale& stale, ScenePainter& painter, ScreenPasses& passes);
  void draw_stage(const Stale& stale, ScenePainter& painter);

  RenderTarget opaque_;
  RenderTarget stage_;  ///< with everything
  RenderTarget smooth_;
  RedrawTiles coarse_;  ///< of the stage, drawn while something moved: drawn again once it rests
  std::optional<Moment> shown_{};  ///< none: nothing yet
};

}  // namespace kerf
