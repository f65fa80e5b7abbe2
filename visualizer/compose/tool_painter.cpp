// SPDX-License-Identifier: Apache-2.0

#include "visualizer/compose/tool_painter.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include <glm/gtc/matrix_inverse.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "visualizer/scene/camera.hpp"

namespace kerf {

namespace {

// An arrow's head, in thicknesses of its shaft, which ends within the head.
constexpr double kHeadLength = 4.0;
constexpr double kHeadRadius = 2.2;
constexpr double kHeadBare = 0.9;  // of its length: without shaft
constexpr float kFaint = 0.30F;    // opacity of what is behind other things

/// Axes with y along `direction`, moved to `at`.
glm::dmat4 along(const glm::dvec3& at, const glm::dvec3& direction) {
  const glm::dvec3 y = glm::normalize(direction);
  const glm::dvec3 other = std::abs(y.x) < 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 0, 1);
  const glm::dvec3 x = glm::normalize(glm::cross(y, other));
  return {glm::dvec4(x, 0.0), glm::dvec4(y, 0.0), glm::dvec4(glm::cross(x, y), 0.0),
          glm::dvec4(at, 1.0)};
}

}  // namespace

GpuMesh::GpuMesh(const Mesh& mesh) : indices_(static_cast<GLsizei>(mesh.triangles.size())) {
  glNamedBufferData(vertices_.id(),
                    static_cast<GLsizeiptr>(mesh.vertices.size() * sizeof(Mesh::Vertex)),
                    mesh.vertices.data(), GL_STATIC_DRAW);
  glNamedBufferData(triangles_.id(),
                    static_cast<GLsizeiptr>(mesh.triangles.size() * sizeof(std::uint32_t)),
                    mesh.triangles.data(), GL_STATIC_DRAW);
  glVertexArrayVertexBuffer(array_.id(), 0, vertices_.id(), 0, sizeof(Mesh::Vertex));
  glVertexArrayElementBuffer(array_.id(), triangles_.id());
  constexpr GLuint kNormalOffset = offsetof(Mesh::Vertex, normal);
  for (const GLuint attribute : {0U, 1U}) {
    glEnableVertexArrayAttrib(array_.id(), attribute);
    glVertexArrayAttribFormat(array_.id(), attribute, 3, GL_FLOAT, GL_FALSE,
                              attribute * kNormalOffset);
    glVertexArrayAttribBinding(array_.id(), attribute, 0);
  }
}

void GpuMesh::draw() const {
  glBindVertexArray(array_.id());
  glDrawElements(GL_TRIANGLES, indices_, GL_UNSIGNED_INT, nullptr);
}

void MeshPainter::use_program(const glm::dmat4& world_from_mesh, const Paint& paint, float opacity,
                              const View& view) {
  const GlProgram& program = paint.metal ? metal_ : plain_;
  const glm::dmat4 eye_from_mesh = view.eye_from_world * world_from_mesh;
  program.set("u_eye_from_mesh", glm::mat4(eye_from_mesh));
  program.set("u_eye_from_mesh_normal",
              glm::mat3(glm::inverseTranspose(glm::dmat3(eye_from_mesh))));
  program.set("u_clip_from_eye", glm::mat4(view.clip_from_eye()));
  program.set("u_colour", paint.colour);
  program.set("u_opacity", opacity);
  program.set("u_up_eye", glm::vec3(view.eye_from_world * glm::dvec4(0, 1, 0, 0)));
  program.use();
}

void MeshPainter::draw(const GpuMesh& mesh, const glm::dmat4& world_from_mesh, const Paint& paint,
                       const View& view, const RenderTarget& target) {
  target.bind();
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glEnable(GL_CULL_FACE);
  glDisable(GL_BLEND);
  use_program(world_from_mesh, paint, 1.0F, view);
  mesh.draw();  // once within the bounds: beside the parts it is there already, at the same depth
  glDisable(GL_CULL_FACE);
}

void MeshPainter::draw_arrow(const glm::dvec3& foot_mm, const glm::dvec3& arrow_mm,
                             double thickness_mm, const Paint& paint, const View& view,
                             const RenderTarget& target) {
  const double length = glm::length(arrow_mm);
  if (!(length > 0.0)) return;
  const double head = std::min(length, kHeadLength * thickness_mm);
  const glm::dmat4 axis = along(foot_mm, arrow_mm);
  const glm::dmat4 shaft =
      glm::scale(axis, glm::dvec3(thickness_mm, length - kHeadBare * head, thickness_mm));
  const glm::dmat4 tip =
      glm::scale(glm::translate(axis, glm::dvec3(0.0, length - head, 0.0)),
                 glm::dvec3(kHeadRadius * thickness_mm, head, kHeadRadius * thickness_mm));

  target.bind();
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_GREATER);
  glDepthMask(GL_FALSE);
  glEnable(GL_CULL_FACE);
  use_program(shaft, paint, kFaint, view);
  target.for_parts([&] { cylinder_.draw(); });
  use_program(tip, paint, kFaint, view);
  target.for_parts([&] { cone_.draw(); });
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_LESS);
  draw(cylinder_, shaft, paint, view, target);
  draw(cone_, tip, paint, view, target);
}

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
