// SPDX-License-Identifier: Apache-2.0
#include "visualizer/volume_on_gpu.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include <glm/gtc/matrix_transform.hpp>

#include "visualizer/error.hpp"

namespace kerf {

namespace {

constexpr int kShell = 1;  // voxels of air around the volume
constexpr std::array<GLenum, 3> kWrapAxes{GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R};
constexpr std::array<GLenum, 5> kUnpackPlaces{GL_UNPACK_ROW_LENGTH, GL_UNPACK_IMAGE_HEIGHT,
                                              GL_UNPACK_SKIP_PIXELS, GL_UNPACK_SKIP_ROWS,
                                              GL_UNPACK_SKIP_IMAGES};

void check_extent(const VolumeView& volume, int max_texture_size) {
  const VoxelGrid& n = volume.bricks.grid;
  const int limit = max_texture_size - 2 * kShell;
  if (std::max({n.nx, n.ny, n.nz}) <= limit) return;
  throw VisualizerError("volume " + volume.name + ": " + std::to_string(n.nx) + "x" +
                        std::to_string(n.ny) + "x" + std::to_string(n.nz) +
                        " voxels, and this OpenGL driver takes " + std::to_string(limit) +
                        " a side; crop or resample it");
}

/// Every voxel texture of a volume: filtered or not, and zero where nothing was written.
void make_storage(const GlTexture3D& texture, GLenum format, GLenum filter, glm::ivec3 size) {
  glTextureStorage3D(texture.id(), 1, format, size.x, size.y, size.z);
  glTextureParameteri(texture.id(), GL_TEXTURE_MIN_FILTER, static_cast<GLint>(filter));
  glTextureParameteri(texture.id(), GL_TEXTURE_MAG_FILTER, static_cast<GLint>(filter));
  for (const GLenum axis : kWrapAxes) {
    glTextureParameteri(texture.id(), axis, GL_CLAMP_TO_EDGE);
  }
}

/// Uploads the voxels of `box` out of a whole volume.
void upload_box(const GlTexture3D& texture, const VoxelGrid& grid, const VoxelBox& box,
                GLenum format, GLenum type, const void* whole) {
  const VoxelIndex n = box.extent();
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, grid.nx);
  glPixelStorei(GL_UNPACK_IMAGE_HEIGHT, grid.ny);
  glPixelStorei(GL_UNPACK_SKIP_PIXELS, box.lo.x);
  glPixelStorei(GL_UNPACK_SKIP_ROWS, box.lo.y);
  glPixelStorei(GL_UNPACK_SKIP_IMAGES, box.lo.z);
  glTextureSubImage3D(texture.id(), 0, box.lo.x + kShell, box.lo.y + kShell, box.lo.z + kShell, n.x,
                      n.y, n.z, format, type, whole);
  for (const GLenum name : kUnpackPlaces) {
    glPixelStorei(name, 0);  // others upload too
  }
}

glm::dvec3 extent_of(const VoxelGrid& grid) {
  return {grid.nx, grid.ny, grid.nz};
}

}  // namespace

VolumeOnGpu::VolumeOnGpu(const VolumeView& volume, const VolumeContent& content,
                         int max_texture_size, bool skip_empty)
    : bricks_(volume.bricks),
      has_labels_(!content.labels.empty()),
      iso_(static_cast<float>(volume.iso / kDensityMax)),
      texels_(extent_of(volume.bricks.grid) + 2.0 * kShell),
      cells_(volume.bricks.grid, content.density, skip_empty ? volume.iso : Density{0}) {
  check_extent(volume, max_texture_size);
  // Texel coordinate v + 1.5; cell i begins at voxel 8i - 1.
  world_from_texture_ =
      glm::scale(glm::translate(volume.world_from_voxel, glm::dvec3(-kShell - 0.5)), texels_);
  world_from_cell_ = glm::scale(glm::translate(volume.world_from_voxel, glm::dvec3(-1.0)),
                                glm::dvec3(Macrocells::kEdge));

  const VoxelGrid& grid = bricks_.grid;
  const glm::ivec3 size(texels_);
  make_storage(density_, GL_R16, GL_LINEAR, size);
  glClearTexImage(density_.id(), 0, GL_RED, GL_UNSIGNED_SHORT, nullptr);
  upload_box(density_, grid, grid.box(), GL_RED, GL_UNSIGNED_SHORT, content.density.data());
  make_storage(labels_, GL_R8UI, GL_NEAREST, has_labels_ ? size : glm::ivec3(1));
  glClearTexImage(labels_.id(), 0, GL_RED_INTEGER, GL_UNSIGNED_BYTE, nullptr);
  if (has_labels_) {
    upload_box(labels_, grid, grid.box(), GL_RED_INTEGER, GL_UNSIGNED_BYTE, content.labels.data());
  }
  make_storage(active_, GL_R8UI, GL_NEAREST, glm::ivec3(extent_of(cells_.grid())));
  glVertexArrayVertexBuffer(face_array_.id(), 0, faces_.id(), 0, 4 * sizeof(std::uint16_t));
  glEnableVertexArrayAttrib(face_array_.id(), 0);
  glVertexArrayAttribIFormat(face_array_.id(), 0, 4, GL_UNSIGNED_SHORT, 0);
  glVertexArrayBindingDivisor(face_array_.id(), 0, 1);
  upload_cells();
}

void VolumeOnGpu::update_bricks(std::span<const Density> density,
                                std::span<const std::uint32_t> changed) {
  bool flipped = false;
  for (const std::uint32_t id : changed) {
    upload_box(density_, bricks_.grid, bricks_.voxels(id), GL_RED, GL_UNSIGNED_SHORT,
               density.data());
    flipped = cells_.update_brick(bricks_.brick(id), density) || flipped;
  }
  if (flipped) upload_cells();
}

void VolumeOnGpu::upload_cells() {
  const VoxelGrid& n = cells_.grid();
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage3D(active_.id(), 0, 0, 0, 0, n.nx, n.ny, n.nz, GL_RED_INTEGER, GL_UNSIGNED_BYTE,
                      cells_.active().data());
  const auto faces = cells_.boundary_faces();
  face_count_ = static_cast<GLsizei>(faces.size());
  glNamedBufferData(faces_.id(), static_cast<GLsizeiptr>(faces.size() * sizeof(faces[0])),
                    faces.data(), GL_DYNAMIC_DRAW);
}

void VolumeOnGpu::bind_textures() const {
  glBindTextureUnit(0, density_.id());
  glBindTextureUnit(1, labels_.id());
  glBindTextureUnit(2, active_.id());
}

void VolumeOnGpu::draw_cell_faces() const {
  constexpr GLsizei kVerticesPerFace = 6;
  glBindVertexArray(face_array_.id());
  glDrawArraysInstanced(GL_TRIANGLES, 0, kVerticesPerFace, face_count_);
}

}  // namespace kerf
