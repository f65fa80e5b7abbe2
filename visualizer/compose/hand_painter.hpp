// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "shared/segment/layout.hpp"
#include "visualizer/compose/mesh_painter.hpp"
#include "visualizer/view/pixel_rect.hpp"
#include "visualizer/view/scene_view.hpp"

namespace kerf {

/// What the hand holds and feels at one moment.
struct Hand {
  glm::dvec3 tip_mm{0.0};
  glm::dvec4 orientation{0.0, 0.0, 0.0, 1.0};  ///< quaternion x, y, z, w
  std::uint32_t tool = 0;                      ///< none where the scene has fewer
  glm::dvec3 force_n{0.0};
  friend bool operator==(const Hand&, const Hand&) noexcept = default;
  /// The same tool in the same place, whatever it feels.
  [[nodiscard]] bool rests_at(const Hand& other) const noexcept {
    return tip_mm == other.tip_mm && orientation == other.orientation && tool == other.tool;
  }
};

/// The tip is the proxy's, where there is one: a tool that is held by the tooth's surface is drawn
/// there, however deep the hand pushes. Nothing before docking, when its place is unknown.
[[nodiscard]] std::optional<Hand> hand_of(const TickRecord& record);

/// Draws the tool and the arrow of its force.
class HandPainter {
 public:
  /// `scale_mm` is the size of what is looked at: lengths of the arrow follow it.
  HandPainter(const SceneView& scene, double scale_mm);

  void draw_tool(const Hand& hand, const View& view, const RenderTarget& target);
  void draw_force(const Hand& hand, const View& view, const RenderTarget& target);
  /// Rectangles of pixels that both may touch: several along each, which seldom stand upright.
  [[nodiscard]] std::vector<PixelRect> bounds(const Hand& hand, const View& view,
                                              PictureSize size) const;

 private:
  struct Tool {
    GpuMesh mesh;
    glm::dvec3 low_mm, high_mm;  ///< its box, in its own axes
    double radius_mm;
  };
  struct Arrow {
    glm::dvec3 foot_mm, shaft_mm;
    double thickness_mm;
  };
  [[nodiscard]] Arrow arrow_of(const Hand& hand) const;

  std::vector<Tool> tools_;
  double scale_mm_;
  MeshPainter painter_;
};

}  // namespace kerf
