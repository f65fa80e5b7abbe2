// SPDX-License-Identifier: Apache-2.0

#include "visualizer/render/macrocell_faces.hpp"

#include <array>

#include <glm/gtc/matrix_transform.hpp>

namespace kerf {
namespace {

VoxelIndex cell_of(const CellFaces::Face& face) {
  return {face[0], face[1], face[2]};
}

std::vector<CellFaces::Run> runs_of(const std::vector<std::size_t>& slots) {
  std::vector<CellFaces::Run> runs;
  for (const std::size_t slot : slots) {
    if (runs.empty() || runs.back().end != slot) runs.push_back({slot, slot});
    runs.back().end = slot + 1;
  }
  return runs;
}

}  // namespace

CellFaces::CellFaces(const Macrocells& cells) : faces_(cells.boundary_faces()) {}

std::vector<CellFaces::Run> CellFaces::update(const Macrocells& cells, const VoxelBox& flipped) {
  const VoxelBox near = flipped.grown(1).clipped(cells.grid().box());
  const std::vector<Face> fresh = cells.boundary_faces(near);
  std::vector<std::size_t> slots;
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    if (near.contains(cell_of(faces_[i]))) slots.push_back(i);
  }
  // New faces take the slots of the old ones, and more slots at the end.
  for (std::size_t more = slots.size(); more < fresh.size(); ++more) {
    slots.push_back(faces_.size());
    faces_.emplace_back();
  }
  for (std::size_t i = 0; i < fresh.size(); ++i) faces_[slots[i]] = fresh[i];
  // A slot that is left takes the last face. The highest is filled first, so the last face is in
  // none of them.
  for (std::size_t left = slots.size(); left > fresh.size(); --left) {
    faces_[slots[left - 1]] = faces_.back();
    faces_.pop_back();
  }
  while (!slots.empty() && slots.back() >= faces_.size()) slots.pop_back();
  return runs_of(slots);
}

VoxelBox CellFaces::active_box() const {
  VoxelBox box;
  for (const Face& face : faces_) box = box.with(cell_of(face));
  return box;
}

CellTexture::CellTexture(const BrickGrid& bricks, std::span<const Density> density,
                         Density threshold, std::int32_t edge)
    : bricks_(bricks), cells_(bricks.grid, density, threshold, edge) {
  const VoxelGrid& n = cells_.grid();
  glTextureStorage3D(texture_.id(), 1, GL_R8UI, n.nx, n.ny, n.nz);
  read_nearest(texture_.id());
  upload(n.box());
}

VoxelBox CellTexture::update_bricks(std::span<const Density> density,
                                    const ChangedBricks& changed) {
  const VoxelBox flipped = cells_.update_bricks(bricks_, changed, density);
  if (!flipped.empty()) upload(flipped);
  return flipped;
}

void CellTexture::upload(const VoxelBox& cells) {
  const VoxelGrid& grid = cells_.grid();
  const VoxelIndex n = cells.extent();
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, grid.nx);
  glPixelStorei(GL_UNPACK_IMAGE_HEIGHT, grid.ny);
  glTextureSubImage3D(texture_.id(), 0, cells.lo.x, cells.lo.y, cells.lo.z, n.x, n.y, n.z,
                      GL_RED_INTEGER, GL_UNSIGNED_BYTE,
                      &cells_.active()[grid.index(cells.lo.x, cells.lo.y, cells.lo.z)]);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);  // others upload too
  glPixelStorei(GL_UNPACK_IMAGE_HEIGHT, 0);
}

CellsOnGpu::CellsOnGpu(const VolumeView& volume, std::span<const Density> density,
                       Density threshold)
    : cells_(volume.bricks, density, threshold), faces_(cells_.cells()) {
  set_transform(volume.world_from_voxel);
  glVertexArrayVertexBuffer(face_array_.id(), 0, face_buffer_.id(), 0, sizeof(CellFaces::Face));
  glEnableVertexArrayAttrib(face_array_.id(), 0);
  glVertexArrayAttribIFormat(face_array_.id(), 0, 4, GL_UNSIGNED_SHORT, 0);
  glVertexArrayBindingDivisor(face_array_.id(), 0, 1);
  const std::size_t most = CellFaces::most(cells_.cells().grid());
  glNamedBufferStorage(face_buffer_.id(), static_cast<GLsizeiptr>(most * sizeof(CellFaces::Face)),
                       nullptr, GL_DYNAMIC_STORAGE_BIT);
  upload_faces(std::array{CellFaces::Run{0, faces_.all().size()}});
}

void CellsOnGpu::update_bricks(std::span<const Density> density, const ChangedBricks& changed) {
  const VoxelBox flipped = cells_.update_bricks(density, changed);
  if (!flipped.empty()) upload_faces(faces_.update(cells_.cells(), flipped));
}

void CellsOnGpu::set_transform(const glm::dmat4& world_from_voxel) {
  // Cell i begins at voxel 8i - 1.
  world_from_cell_ =
      glm::scale(glm::translate(world_from_voxel, glm::dvec3(-1.0)), glm::dvec3(Macrocells::kEdge));
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

RayEntries::Buffer::Buffer(PictureSize of_size, int layers) : size(of_size) {
  glTextureStorage3D(entry_mm.id(), 1, GL_R32F, size.width, size.height, layers);
  read_nearest(entry_mm.id());
  glTextureStorage2D(depth.id(), 1, GL_DEPTH_COMPONENT32F, size.width, size.height);
  glNamedFramebufferTexture(framebuffer.id(), GL_DEPTH_ATTACHMENT, depth.id(), 0);
}

void RayEntries::draw(int layer, const CellsOnGpu& cells, const View& view,
                      const RenderTarget& target) {
  const PictureSize size = target.size();
  const PixelRect& part = target.bounds();
  if (!buffer_ || buffer_->size != size) buffer_.emplace(size, layers_);
  const std::array<float, 4> nowhere{static_cast<float>(view.far_mm)};
  const float farthest = 1.0F;
  const GLuint framebuffer = buffer_->framebuffer.id();
  glNamedFramebufferTextureLayer(framebuffer, GL_COLOR_ATTACHMENT0, buffer_->entry_mm.id(), 0,
                                 layer);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glViewport(0, 0, size.width, size.height);
  glEnable(GL_SCISSOR_TEST);
  glScissor(part.x0, part.y0, part.x1 - part.x0, part.y1 - part.y0);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
  glClearNamedFramebufferfv(framebuffer, GL_COLOR, 0, nowhere.data());
  glClearNamedFramebufferfv(framebuffer, GL_DEPTH, 0, &farthest);
  program_.set("u_clip_from_cell",
               glm::mat4(view.clip_from_eye() * view.eye_from_world * cells.world_from_cell()));
  program_.set("u_near_mm", static_cast<float>(view.near_mm));
  program_.use();
  // Faces before the near plane count too: they mark where a ray is inside.
  glEnable(GL_DEPTH_CLAMP);
  cells.draw_faces();
  glDisable(GL_DEPTH_CLAMP);
}

}  // namespace kerf
