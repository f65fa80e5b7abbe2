// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "visualizer/compose/mesh.hpp"
#include "visualizer/gl/program.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/view/camera.hpp"

namespace kerf {

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
  /// `world_from_mesh` may scale; hidden where something nearer is in `target`.
  void draw(const GpuMesh& mesh, const glm::dmat4& world_from_mesh, const Paint& paint,
            const View& view, const RenderTarget& target);

  /// From `foot_mm` along `arrow_mm`. The part behind other things shines through faintly, so that
  /// a force is seen in a deep cavity too.
  void draw_arrow(const glm::dvec3& foot_mm, const glm::dvec3& arrow_mm, double thickness_mm,
                  const Paint& paint, const View& view, const RenderTarget& target);

 private:
  void use_program(const glm::dmat4& world_from_mesh, const Paint& paint, float opacity,
                   const View& view);

  GlProgram plain_{{"mesh.vert", "mesh.frag", "lighting.frag"}, "#define KERF_METAL 0\n"};
  GlProgram metal_{{"mesh.vert", "mesh.frag", "lighting.frag"}, "#define KERF_METAL 1\n"};
  GpuMesh cylinder_{unit_cylinder()};
  GpuMesh cone_{unit_cone()};
};

}  // namespace kerf
