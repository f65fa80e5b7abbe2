// SPDX-License-Identifier: Apache-2.0
#include "visualizer/compose/hand_painter.hpp"

#include <cmath>
#include <limits>

#include "visualizer/view/camera.hpp"

namespace kerf {

namespace {

constexpr double kArrowScalesPerN = 0.3;  // 1 N: 0.3 of the scale; 3.3 N about one
constexpr double kArrowThickness = 0.014;
constexpr double kArrowHeadRadii = 2.2;
constexpr double kLeastArrowN = 0.01;  // below, the report does not count a contact either
const Paint kSteel{.colour = {0.60F, 0.60F, 0.61F}, .metal = true};
const Paint kForce{.colour = {0.75F, 0.13F, 0.01F}, .metal = false};  // vermillion

constexpr int kPieces = 6;  // of a tool or an arrow: rectangles that follow it

glm::dmat4 pose_of(const Hand& hand) {
  return rigid(hand.tip_mm, hand.orientation);
}

}  // namespace

std::optional<Hand> hand_of(const TickRecord& record) {
  const auto& p = record.position_mm;
  if (!std::isfinite(p[0])) return std::nullopt;
  const auto& q = record.orientation;
  const auto& f = record.commanded_force_n;
  const auto& off = record.proxy_offset_mm;
  return Hand{{p[0] + off[0], p[1] + off[1], p[2] + off[2]},
              {q[0], q[1], q[2], q[3]},
              record.active_tool,
              {f[0], f[1], f[2]}};
}

HandPainter::HandPainter(const SceneView& scene, double scale_mm) : scale_mm_(scale_mm) {
  for (const ToolView& tool : scene.tools) {
    const Mesh mesh = tool_mesh(tool);
    glm::dvec3 low(std::numeric_limits<double>::max()), high(-low);
    for (const Mesh::Vertex& vertex : mesh.vertices) {
      low = glm::min(low, glm::dvec3(vertex.position));
      high = glm::max(high, glm::dvec3(vertex.position));
    }
    tools_.push_back({GpuMesh(mesh), low, high, tool.radius_mm});
  }
}

HandPainter::Arrow HandPainter::arrow_of(const Hand& hand) const {
  const double strength_n = glm::length(hand.force_n);
  if (strength_n < kLeastArrowN) return {hand.tip_mm, glm::dvec3(0.0), 0.0};
  // From the surface of the head outwards: inside it a small force would not be seen.
  const double head_mm = hand.tool < tools_.size() ? tools_[hand.tool].radius_mm : 0.0;
  return {hand.tip_mm + hand.force_n * (head_mm / strength_n),
          hand.force_n * (kArrowScalesPerN * scale_mm_), kArrowThickness * scale_mm_};
}

void HandPainter::draw_tool(const Hand& hand, const View& view, const RenderTarget& target) {
  if (hand.tool >= tools_.size()) return;
  painter_.draw(tools_[hand.tool].mesh, pose_of(hand), kSteel, view, target);
}

void HandPainter::draw_force(const Hand& hand, const View& view, const RenderTarget& target) {
  const Arrow arrow = arrow_of(hand);
  if (arrow.thickness_mm == 0.0) return;
  painter_.draw_arrow(arrow.foot_mm, arrow.shaft_mm, arrow.thickness_mm, kForce, view, target);
}

std::vector<PixelRect> HandPainter::bounds(const Hand& hand, const View& view,
                                           PictureSize size) const {
  std::vector<PixelRect> bounds;
  const bool is_there =
      hand.tool < tools_.size() && tools_[hand.tool].low_mm.x <= tools_[hand.tool].high_mm.x;
  if (is_there) {
    const Tool& tool = tools_[hand.tool];
    const glm::dmat4 pose = pose_of(hand);
    for (int piece = 0; piece < kPieces; ++piece) {
      glm::dvec3 low = tool.low_mm, high = tool.high_mm;
      low.y = glm::mix(tool.low_mm.y, tool.high_mm.y, static_cast<double>(piece) / kPieces);
      high.y = glm::mix(tool.low_mm.y, tool.high_mm.y, (piece + 1.0) / kPieces);
      bounds.push_back(screen_bounds(box_corners(low, high, pose), view, size));
    }
  }
  const Arrow arrow = arrow_of(hand);
  if (arrow.thickness_mm == 0.0) return bounds;
  const double around_mm = kArrowHeadRadii * arrow.thickness_mm;
  for (int piece = 0; piece < kPieces; ++piece) {
    const glm::dvec3 from = arrow.foot_mm + arrow.shaft_mm * (static_cast<double>(piece) / kPieces);
    const glm::dvec3 to = arrow.foot_mm + arrow.shaft_mm * ((piece + 1.0) / kPieces);
    bounds.push_back(screen_bounds(
        box_corners(glm::min(from, to) - around_mm, glm::max(from, to) + around_mm), view, size));
  }
  return bounds;
}

}  // namespace kerf
