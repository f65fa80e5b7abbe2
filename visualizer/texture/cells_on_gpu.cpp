// SPDX-License-Identifier: Apache-2.0
#include "visualizer/texture/cells_on_gpu.hpp"

#include <array>

#include <glm/gtc/matrix_transform.hpp>

namespace kerf {

CellsOnGpu::CellsOnGpu(const VolumeView& volume, std::span<const Density> density,
                       Density threshold)
    : bricks_(volume.bricks), cells_(volume.bricks.grid, density, threshold), faces_(cells_) {
  place(volume.world_from_voxel);
  const VoxelGrid& n = cells_.grid();
  glTextureStorage3D(active_.id(), 1, GL_R8UI, n.nx, n.ny, n.nz);
  glTextureParameteri(active_.id(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTextureParameteri(active_.id(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glVertexArrayVertexBuffer(face_array_.id(), 0, face_buffer_.id(), 0, sizeof(CellFaces::Face));
  glEnableVertexArrayAttrib(face_array_.id(), 0);
  glVertexArrayAttribIFormat(face_array_.id(), 0, 4, GL_UNSIGNED_SHORT, 0);
  glVertexArrayBindingDivisor(face_array_.id(), 0, 1);
  glNamedBufferStorage(face_buffer_.id(),
                       static_cast<GLsizeiptr>(CellFaces::most(n) * sizeof(CellFaces::Face)),
                       nullptr, GL_DYNAMIC_STORAGE_BIT);
  upload_active(n.box());
  upload_faces(std::array{CellFaces::Run{0, faces_.all().size()}});
}

void CellsOnGpu::update_bricks(std::span<const Density> density,
                               std::span<const std::uint32_t> changed) {
  const VoxelBox flipped = cells_.update_bricks(bricks_, changed, density);
  if (flipped.empty()) return;
  upload_active(flipped);
  upload_faces(faces_.update(cells_, flipped));
}

void CellsOnGpu::place(const glm::dmat4& world_from_voxel) {
  // Cell i begins at voxel 8i - 1.
  world_from_cell_ =
      glm::scale(glm::translate(world_from_voxel, glm::dvec3(-1.0)), glm::dvec3(Macrocells::kEdge));
}

void CellsOnGpu::upload_active(const VoxelBox& cells) {
  const VoxelGrid& grid = cells_.grid();
  const VoxelIndex n = cells.extent();
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, grid.nx);
  glPixelStorei(GL_UNPACK_IMAGE_HEIGHT, grid.ny);
  glTextureSubImage3D(active_.id(), 0, cells.lo.x, cells.lo.y, cells.lo.z, n.x, n.y, n.z,
                      GL_RED_INTEGER, GL_UNSIGNED_BYTE,
                      &cells_.active()[grid.index(cells.lo.x, cells.lo.y, cells.lo.z)]);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);  // others upload too
  glPixelStorei(GL_UNPACK_IMAGE_HEIGHT, 0);
}

void CellsOnGpu::upload_faces(std::span<const CellFaces::Run> runs) {
  constexpr std::size_t kBytes = sizeof(CellFaces::Face);
  for (const auto& [first, end] : runs) {
    glNamedBufferSubData(face_buffer_.id(), static_cast<GLintptr>(first * kBytes),
                         static_cast<GLsizeiptr>((end - first) * kBytes),
                         faces_.all().data() + first);
  }
  active_box_ = faces_.active_box();
}

void CellsOnGpu::draw_faces() const {
  constexpr GLsizei kVerticesPerFace = 6;
  glBindVertexArray(face_array_.id());
  glDrawArraysInstanced(GL_TRIANGLES, 0, kVerticesPerFace,
                        static_cast<GLsizei>(faces_.all().size()));
}

}  // namespace kerf
