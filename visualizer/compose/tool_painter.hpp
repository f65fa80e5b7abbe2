// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

#include "shared/segment/layout.hpp"
#include "visualizer/gl/program.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/scene/camera.hpp"
#include "visualizer/scene/pixel_rect.hpp"
#include "visualizer/scene/scene_view.hpp"
#include "visualizer/scene/session.hpp"

namespace kerf {

/// Triangles with a normal per vertex; counter-clockwise from the outside.
struct Mesh {
  struct Vertex {
    glm::vec3 position;
    glm::vec3 normal;
  };
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> triangles;  ///< three indices each

  void append(const Mesh& other);
};

/// A profile point: height on the axis (y) and distance from it.
using ProfilePoint = std::array<double, 2>;

/// The closed body that `profile` (from low to high y) sweeps about the y axis; flat lids close an
/// end that is not on the axis. Edges sharper than 40 degrees stay sharp. Empty for fewer than two
/// points.
[[nodiscard]] Mesh lathe(std::span<const ProfilePoint> profile);

/// A closed mesh with normals. Edges sharper than 40 degrees stay sharp.
[[nodiscard]] Mesh shaded(const Facets& facets);

/// What a bur is made of: the head by its profile (mm), and the shaft behind it if the servo loads
/// that; else a shank along +y, thinner than the head, that begins inside it. Neither if the head
/// has no extent. A head that is a mesh has no outline.
using Outlines = std::vector<std::vector<ProfilePoint>>;
[[nodiscard]] Outlines tool_outlines(const ToolView& tool);
/// All of it as a mesh.
[[nodiscard]] Mesh tool_mesh(const ToolView& tool);

/// Cylinder of radius 1 from y = 0 to 1, and cone of base radius 1 from y = 0 to its tip at 1.
[[nodiscard]] Mesh unit_cylinder();
[[nodiscard]] Mesh unit_cone();

/// A mesh in the memory of the GPU.
class GpuMesh {
 public:
  explicit GpuMesh(const Mesh& mesh);
  void draw() const;

 private:
  GlBuffer vertices_ = GlBuffer::create();
  GlBuffer triangles_ = GlBuffer::create();
  GlVertexArray array_ = GlVertexArray::create();
  GLsizei indices_ = 0;
};

/// What a mesh is painted with.
struct Paint {
  glm::vec3 colour{0.55F, 0.56F, 0.58F};  ///< linear
  bool metal = false;
};

/// Draws meshes over the volumes, with true depth (the paper's equation (1)).
class MeshPainter {
 public:
  /// `light`: "plain_normals.frag" draws normals, as paint without metal.
  explicit MeshPainter(std::string_view light = "lighting.frag");

  /// `world_from_mesh` may scale; hidden behind anything nearer that is in `target`.
  void draw(const GpuMesh& mesh, const glm::dmat4& world_from_mesh, const Paint& paint,
            const View& view, const RenderTarget& target);

  /// From `foot_mm` along `arrow_mm`. The part behind other things shines through faintly, so that
  /// a force is seen in a deep cavity too.
  void draw_arrow(const glm::dvec3& foot_mm, const glm::dvec3& arrow_mm, double thickness_mm,
                  const Paint& paint, const View& view, const RenderTarget& target);

 private:
  void use_program(const glm::dmat4& world_from_mesh, const Paint& paint, float opacity,
                   const View& view);

  GlProgram plain_, metal_;
  GpuMesh cylinder_{unit_cylinder()};
  GpuMesh cone_{unit_cone()};
};

/// Tool, pose and force of the hand at one tick.
struct Hand {
  glm::dvec3 tip_mm{0.0};
  glm::dvec4 orientation{0.0, 0.0, 0.0, 1.0};  ///< quaternion x, y, z, w
  std::uint32_t tool = 0;                      ///< none if the scene has fewer
  glm::dvec3 force_n{0.0};
  friend bool operator==(const Hand&, const Hand&) noexcept = default;
  /// Whether tool and pose are equal; forces may differ.
  [[nodiscard]] bool rests_at(const Hand& other) const noexcept {
    return tip_mm == other.tip_mm && orientation == other.orientation && tool == other.tool;
  }
};

/// The tip is the proxy's, if there is one: a tool that is held by the tooth's surface is drawn
/// there, however deep the hand pushes. Nothing before docking, when its place is unknown.
[[nodiscard]] std::optional<Hand> hand_of(const TickRecord& record);

/// The hand of each arm, by its index; none: there is no such arm, or its place is unknown.
using Hands = std::array<std::optional<Hand>, kMaxArms>;
[[nodiscard]] Hands hands_of(const Session& session);

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
  Paint steel_;
  MeshPainter painter_;
};

}  // namespace kerf
