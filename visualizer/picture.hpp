// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "visualizer/camera.hpp"
#include "visualizer/mesh_painter.hpp"
#include "visualizer/overlay.hpp"
#include "visualizer/renderer.hpp"
#include "visualizer/session.hpp"

namespace kerf {

/// Everything that is seen of one session: backdrop, volumes, tool, force arrow, panel.
///
/// Made after the first `poll` of its session, which is uploaded whole; later only what changed.
class Picture {
 public:
  /// `renderer` as on the command line.
  Picture(const Session& session, std::string_view renderer, double aspect);

  /// Uploads the bricks that the last `poll` changed. Call once after each `poll`.
  void update(const Session& session);

  /// Draws the present state whole into `target`; its depth is not used.
  void draw(const Session& session, const OverlayFigures& figures, const RenderTarget& target);

  [[nodiscard]] OrbitCamera& camera() noexcept { return camera_; }
  void reset_camera(double aspect);
  [[nodiscard]] std::uint64_t bricks_uploaded() const noexcept { return bricks_uploaded_; }

 private:
  void draw_backdrop(const RenderTarget& target);
  void smooth_edges(const RenderTarget& from, const RenderTarget& to);
  void draw_tool(const TickRecord& record, const View& view, const RenderTarget& target);
  void draw_force(const TickRecord& record, const View& view, const RenderTarget& target);

  SceneView scene_;
  std::unique_ptr<Renderer> renderer_;
  OrbitCamera camera_;
  std::optional<View> last_view_;
  double radius_mm_ = 1.0;  ///< of the main volume's box: the size of what is looked at
  glm::dvec3 centre_mm_{0, 0, 0};
  double reach_mm_ = 1.0;  ///< from that centre to the farthest corner of any volume
  GlProgram backdrop_{"screen.vert", "backdrop.frag"};
  GlProgram smooth_{"screen.vert", "smooth.frag"};
  std::optional<RenderTarget> stage_;  ///< the picture before its edges are smoothed
  GlVertexArray no_vertices_ = GlVertexArray::create();
  std::vector<GpuMesh> tools_;
  MeshPainter painter_;
  Overlay overlay_;
  std::uint64_t bricks_uploaded_ = 0;
};

/// The figures of the panel as the session stands; the caller adds what it alone knows.
[[nodiscard]] OverlayFigures overlay_figures(const Session& session);

}  // namespace kerf
