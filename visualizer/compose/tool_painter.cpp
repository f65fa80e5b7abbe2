// SPDX-License-Identifier: Apache-2.0

#include "visualizer/compose/tool_painter.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include <glm/gtc/matrix_inverse.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "visualizer/scene/camera.hpp"

namespace kerf {

namespace {

constexpr std::uint32_t kSides = 48;
constexpr double kCreaseDegrees = 40.0;
const double kCosCrease = std::cos(kCreaseDegrees * std::numbers::pi / 180.0);

// Neck and shank of a real bur, in radii of its head; the last three from the head's end.
constexpr double kNeckPerRadius = 0.42;
constexpr double kShankPerRadius = 0.62;
constexpr double kNeckRadii = 1.5;
constexpr double kShankFromRadii = 2.5;
constexpr double kShankToRadii = 16.0;

/// Outward normal (y, radial) of the wall between two profile points.
glm::dvec2 wall_normal(const ProfilePoint& low, const ProfilePoint& high) {
  const glm::dvec2 normal(low[1] - high[1], high[0] - low[0]);
  return normal / glm::length(normal);
}

void append_ring(Mesh& mesh, const ProfilePoint& at, const glm::dvec2& normal) {
  for (std::uint32_t i = 0; i <= kSides; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kSides;
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    mesh.vertices.push_back(
        {glm::vec3(at[1] * c, at[0], at[1] * s), glm::vec3(normal.y * c, normal.x, normal.y * s)});
  }
}

}  // namespace

void Mesh::append(const Mesh& other) {
  const auto base = static_cast<std::uint32_t>(vertices.size());
  vertices.insert(vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const std::uint32_t index : other.triangles) triangles.push_back(base + index);
}

Mesh lathe(std::span<const ProfilePoint> profile) {
  std::vector<ProfilePoint> points;
  for (const ProfilePoint& point : profile) {
    if (points.empty() || points.back() != point) points.push_back(point);
  }
  if (points.size() < 2) return {};
  if (points.front()[1] > 0.0) points.insert(points.begin(), {points.front()[0], 0.0});
  if (points.back()[1] > 0.0) points.push_back({points.back()[0], 0.0});

  const std::size_t walls = points.size() - 1;
  const auto normal_at = [&](std::size_t wall, std::size_t point) {
    const glm::dvec2 own = wall_normal(points[wall], points[wall + 1]);
    const std::size_t other = point == wall ? wall - 1 : wall + 1;  // wraps below 0: no wall
    if (other >= walls) return own;
    const glm::dvec2 next = wall_normal(points[other], points[other + 1]);
    return glm::dot(own, next) < kCosCrease ? own : glm::normalize(own + next);
  };
  Mesh mesh;
  glm::dvec2 last_normal(0.0);
  for (std::size_t wall = 0; wall < walls; ++wall) {
    // Walls that meet smoothly have the same normals there, and share the ring.
    const glm::dvec2 low_normal = normal_at(wall, wall), high_normal = normal_at(wall, wall + 1);
    if (low_normal != last_normal) append_ring(mesh, points[wall], low_normal);
    const auto base = static_cast<std::uint32_t>(mesh.vertices.size()) - (kSides + 1);
    append_ring(mesh, points[wall + 1], high_normal);
    last_normal = high_normal;
    for (std::uint32_t i = 0; i < kSides; ++i) {
      const std::uint32_t low = base + i;
      const std::uint32_t high = low + kSides + 1;
      mesh.triangles.insert(mesh.triangles.end(), {low, high, low + 1, low + 1, high, high + 1});
    }
  }
  return mesh;
}

Mesh shaded(const Facets& facets) {
  const auto point = [&](std::uint32_t i) {
    const auto& p = facets.points_mm[i];
    return glm::dvec3(p[0], p[1], p[2]);
  };
  std::vector<glm::dvec3> area;  // by triangle, along its normal
  std::vector<std::vector<std::size_t>> meeting(facets.points_mm.size());
  for (const auto& [a, b, c] : facets.triangles) {
    for (const std::uint32_t corner : {a, b, c}) meeting[corner].push_back(area.size());
    area.push_back(glm::cross(point(b) - point(a), point(c) - point(a)));
  }
  Mesh mesh;
  for (std::size_t t = 0; t < area.size(); ++t) {
    const double own = glm::length(area[t]);
    if (!(own > 1e-12)) continue;  // mm^2: no face to see
    for (const std::uint32_t corner : facets.triangles[t]) {
      glm::dvec3 normal(0.0);
      for (const std::size_t other : meeting[corner]) {
        const double product = own * glm::length(area[other]);
        if (glm::dot(area[t], area[other]) >= kCosCrease * product) normal += area[other];
      }
      mesh.triangles.push_back(static_cast<std::uint32_t>(mesh.vertices.size()));
      mesh.vertices.push_back({glm::vec3(point(corner)), glm::vec3(glm::normalize(normal))});
    }
  }
  return mesh;
}

Outlines tool_outlines(const ToolView& tool) {
  if (tool.radius_mm == 0.0) return {};
  double low = 0.0, high = 0.0;
  Outlines outlines;
  if (tool.facets.triangles.empty()) {
    low = tool.profile_mm.front()[0];
    high = tool.profile_mm.back()[0];
    outlines.push_back(tool.profile_mm);
  }
  for (const auto& [x, y, z] : tool.facets.points_mm) {
    low = std::min(low, y);
    high = std::max(high, y);
  }
  if (!tool.shaft_mm.empty()) {
    outlines.push_back(tool.shaft_mm);
    return outlines;
  }
  // The neck starts inside the head.
  const double neck = kNeckPerRadius * tool.radius_mm;
  const double shank = kShankPerRadius * tool.radius_mm;
  outlines.push_back({{0.5 * (low + high), neck},
                      {high + kNeckRadii * tool.radius_mm, neck},
                      {high + kShankFromRadii * tool.radius_mm, shank},
                      {high + kShankToRadii * tool.radius_mm, shank}});
  return outlines;
}

Mesh tool_mesh(const ToolView& tool) {
  Mesh mesh = shaded(tool.facets);
  for (const auto& outline : tool_outlines(tool)) mesh.append(lathe(outline));
  return mesh;
}

Mesh unit_cylinder() {
  return lathe(std::array<ProfilePoint, 2>{{{0.0, 1.0}, {1.0, 1.0}}});
}

Mesh unit_cone() {
  return lathe(std::array<ProfilePoint, 2>{{{0.0, 1.0}, {1.0, 0.0}}});
}

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

MeshPainter::MeshPainter(std::string_view light)
    : plain_({"mesh.vert", "mesh.frag", light}, "#define KERF_METAL 0\n"),
      metal_({"mesh.vert", "mesh.frag", light}, "#define KERF_METAL 1\n") {}

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

Hands hands_of(const Session& session) {
  Hands hands;
  if (session.latest()) hands[0] = hand_of(*session.latest());
  if (session.second()) hands[1] = hand_of(*session.second());
  return hands;
}

HandPainter::HandPainter(const SceneView& scene, double scale_mm)
    : scale_mm_(scale_mm), steel_(kSteel), painter_(light_of(scene)) {
  steel_.metal = !scene.normals;
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
  painter_.draw(tools_[hand.tool].mesh, pose_of(hand), steel_, view, target);
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
