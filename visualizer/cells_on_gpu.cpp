// SPDX-License-Identifier: Apache-2.0
#include "visualizer/cells_on_gpu.hpp"

#include <glm/gtc/matrix_transform.hpp>

namespace kerf {

CellsOnGpu::CellsOnGpu(const VolumeView& volume, std::span<const Density> density,
                       Density threshold)
    : bricks_(volume.bricks),
      // Cell i begins at voxel 8i - 1.
      world_from_cell_(glm::scale(glm::translate(volume.world_from_voxel, glm::dvec3(-1.0)),
                                  glm::dvec3(Macrocells::kEdge))),
      cells_(volume.bricks.grid, density, threshold) {
  const VoxelGrid& n = cells_.grid();
  glTextureStorage3D(active_.id(), 1, GL_R8UI, n.nx, n.ny, n.nz);
  glTextureParameteri(active_.id(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTextureParameteri(active_.id(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glVertexArrayVertexBuffer(face_array_.id(), 0, faces_.id(), 0, 4 * sizeof(std::uint16_t));
  glEnableVertexArrayAttrib(face_array_.id(), 0);
  glVertexArrayAttribIFormat(face_array_.id(), 0, 4, GL_UNSIGNED_SHORT, 0);
  glVertexArrayBindingDivisor(face_array_.id(), 0, 1);
  upload();
}

void CellsOnGpu::update_bricks(std::span<const Density> density,
                               std::span<const std::uint32_t> changed) {
  if (!cells_.update_bricks(bricks_, changed, density).empty()) upload();
}

void CellsOnGpu::upload() {
  const VoxelGrid& n = cells_.grid();
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage3D(active_.id(), 0, 0, 0, 0, n.nx, n.ny, n.nz, GL_RED_INTEGER, GL_UNSIGNED_BYTE,
                      cells_.active().data());
  const auto faces = cells_.boundary_faces();
  face_count_ = static_cast<GLsizei>(faces.size());
  glNamedBufferData(faces_.id(), static_cast<GLsizeiptr>(faces.size() * sizeof(faces[0])),
                    faces.data(), GL_DYNAMIC_DRAW);
  active_box_ = {};
  for (const auto& [x, y, z, face] : faces) {
    active_box_ = active_box_.united({{x, y, z}, {x + 1, y + 1, z + 1}});
  }
}

void CellsOnGpu::draw_faces() const {
  constexpr GLsizei kVerticesPerFace = 6;
  glBindVertexArray(face_array_.id());
  glDrawArraysInstanced(GL_TRIANGLES, 0, kVerticesPerFace, face_count_);
}

}  // namespace kerf
