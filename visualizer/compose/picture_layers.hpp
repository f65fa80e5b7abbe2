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
#include "visualizer/redraw/redraw_tiles.hpp"
#include "visualizer/render/renderer.hpp"

namespace kerf {

/// Volumes and hands, drawn by the renderers that were chosen for the volumes.
///
/// Volumes with the same choice share a renderer, which mixes them if they intersect; across
/// renderers the depth that all of them write and test decides which is in front. Opaque volumes
/// come first, so that a tool which moves leaves them as they are; translucent ones come after the
/// tools, which shine through them. A tool of voxels is one more volume, drawn as the first one is.
class ScenePainter {
 public:
  /// Opaque volumes lie under everything that moves, translucent ones over it.
  enum class Layer : std::uint8_t { opaque, translucent };

  /// `choice` of renderers: see renderer.hpp. Throws VisualizerError if it does not fit the scene,
  /// or a renderer cannot show its volumes.
  ScenePainter(const std::string& choice, const SceneView& scene,
               std::span<const VolumeContent> contents);

  // As in `Renderer`, for all volumes; `contents` are those of the scene.
  void set_opacities(const SceneView& scene, std::span<const VolumeContent> contents);
  void set_cut_open(bool open, std::span<const VolumeContent> contents);
  void set_moving(bool moving);
  /// Follows the changes of the last poll in a volume.
  void update(std::size_t volume, const VolumeSnapshot& snapshot);
  /// Puts tools of voxels into the hands: before anything is drawn with them.
  void hold(const Hands& hands);

  /// Volumes, and among them tools of voxels.
  void draw_volumes(Layer layer, const View& view, const RenderTarget& target);
  /// The tool as a mesh: after the opaque volumes, before the others.
  void draw_tool(const Hand& hand, const View& view, const RenderTarget& target);
  /// The last of all; after it the next hand's.
  void draw_force(const Hand& hand, const View& view, const RenderTarget& target) {
    hand_.draw_force(hand, view, target);
  }

  [[nodiscard]] bool any(Layer layer) const;
  /// Whether a renderer has a property, such as `&Renderer::coarse_while_moving`.
  [[nodiscard]] bool any(bool (Renderer::*property)() const noexcept) const;
  /// True if the picture of the opaque volumes changes when a hand moves.
  [[nodiscard]] bool hand_is_opaque_volume() const;
  /// Rectangles of pixels that a hand may touch.
  [[nodiscard]] std::vector<PixelRect> bounds(const Hand& hand, const View& view,
                                              PictureSize size) const;

  /// Marks the changes since `forget_changes` in the volumes of a layer, but for tools of voxels.
  /// `kept` is the last picture of the opaque volumes.
  void mark_redraw(Layer layer, RedrawTiles& tiles, const View& view,
                   const RenderTarget& kept) const;
  void forget_changes();

 private:
  struct Group {
    std::unique_ptr<Renderer> renderer;
    std::vector<std::size_t> volumes;
  };
  /// A renderer, and the index that a volume has in it.
  struct RendererIndex {
    std::size_t group, index;
  };

  [[nodiscard]] Renderer& renderer_of(std::size_t volume) const {
    return *groups_[indices_[volume].group].renderer;
  }
  /// Add the tools of voxels if there are some.
  [[nodiscard]] std::vector<VolumeContent> with_tools(
      std::span<const VolumeContent> contents) const;
  [[nodiscard]] SceneView with_tools(const SceneView& scene) const;

  std::vector<VolumeView> volumes_;  ///< of the session
  std::vector<ToolVolume> tools_;    ///< of each arm; empty: they are meshes
  std::vector<Group> groups_;
  std::vector<RendererIndex> indices_;  ///< by volume, the tools' last
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

/// The picture of one eye, kept from frame to frame in three layers: backdrop and opaque volumes;
/// the composite with hands and translucent volumes; the composite with smoothed edges. So a hand
/// that moves over opaque volumes costs no volume.
///
/// What changes is drawn at once if its volumes cover no more pixels than a budget. Else it is
/// drawn coarsely at once and finely later, some tiles with each picture: first those that rest,
/// because those that still change would be drawn again. Tiles that are finished stay as they are.
/// With the last tile the picture has the pixels of one drawn at once.
class PictureLayers {
 public:
  /// What a picture shows beside the volumes.
  struct FrameState {
    View view;
    bool moving = false;  ///< camera or a hand have moved since the last picture
    Hands hands{};
  };
  /// The parts of two layers that must be drawn again, and with which state.
  struct Redraw {
    FrameState now;
    std::vector<PixelRect> coarse;  ///< of the picture, drawn first, each pixel `coarse_edge` wide
    int coarse_edge;
    std::vector<PixelRect> opaque, composite;
    RedrawTiles later;  ///< of all layers, left for the next pictures
    double pixels;      ///< with volumes in them, coarse ones counted as one
    [[nodiscard]] bool empty() const noexcept { return coarse.empty() && composite.empty(); }
  };
  static constexpr int kCoarsest = 8;

  explicit PictureLayers(PictureSize size)
      : opaque_(size), composite_(size), smooth_(size), moved_(size), later_(size) {}

  /// What must be drawn again to show `view`, `hands` and the volumes, within about `most_pixels`.
  [[nodiscard]] Redraw redraw(const View& view, const Hands& hands, const ScenePainter& painter,
                              double most_pixels) const;
  /// Draws it. Returns the parts of `seen` that changed.
  std::vector<PixelRect> draw(const Redraw& redraw, ScenePainter& painter, ScreenPasses& passes);
  /// Whether a part of `seen` is coarser than it will be, though nothing moves.
  [[nodiscard]] bool is_late() const {
    return !later_.empty() || (shown_ && !shown_->moving && !moved_.empty());
  }

  /// The finished picture; its depth is not used.
  [[nodiscard]] const RenderTarget& seen() const noexcept { return smooth_; }

 private:
  void draw_coarse(const Redraw& redraw, ScenePainter& painter, ScreenPasses& passes);
  void draw_opaque(const FrameState& now, std::span<const PixelRect> parts, ScenePainter& painter,
                   ScreenPasses& passes);
  void draw_composite(const FrameState& now, std::span<const PixelRect> parts,
                      ScenePainter& painter);

  RenderTarget opaque_;
  RenderTarget composite_;
  RenderTarget smooth_;
  RedrawTiles moved_;  ///< of the composite, drawn in longer steps: drawn again at rest
  RedrawTiles later_;  ///< of all layers, seen coarsely: not drawn since they changed
  std::unique_ptr<PictureLayers> small_{};  ///< what was drawn coarsely last
  std::optional<FrameState> shown_{};       ///< of the last picture
};

}  // namespace kerf
