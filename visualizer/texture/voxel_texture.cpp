// SPDX-License-Identifier: Apache-2.0
#include "visualizer/texture/voxel_texture.hpp"

#include <algorithm>
#include <array>
#include <string>

#include <glm/gtc/matrix_transform.hpp>

#include "visualizer/error.hpp"

namespace kerf {

namespace {

constexpr std::array<GLenum, 3> kWrapAxes{GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R};
constexpr std::array<GLenum, 5> kUnpackPlaces{GL_UNPACK_ROW_LENGTH, GL_UNPACK_IMAGE_HEIGHT,
                                              GL_UNPACK_SKIP_PIXELS, GL_UNPACK_SKIP_ROWS,
                                              GL_UNPACK_SKIP_IMAGES};

}  // namespace

VoxelTexture::VoxelTexture(const VoxelGrid& grid, TexelFormat format, const void* air)
    : grid_(grid), format_(format) {
  glTextureStorage3D(texture_.id(), 1, format.internal, grid.nx + 2 * kBorder,
                     grid.ny + 2 * kBorder, grid.nz + 2 * kBorder);
  glTextureParameteri(texture_.id(), GL_TEXTURE_MIN_FILTER, static_cast<GLint>(format.filter));
  glTextureParameteri(texture_.id(), GL_TEXTURE_MAG_FILTER, static_cast<GLint>(format.filter));
  for (const GLenum axis : kWrapAxes) {
    glTextureParameteri(texture_.id(), axis, GL_CLAMP_TO_EDGE);
  }
  glClearTexImage(texture_.id(), 0, format.format, format.type, air);
}

void VoxelTexture::upload_from(const void* whole, const VoxelBox& box) {
  glPixelStorei(GL_UNPACK_ROW_LENGTH, grid_.nx);
  glPixelStorei(GL_UNPACK_IMAGE_HEIGHT, grid_.ny);
  glPixelStorei(GL_UNPACK_SKIP_PIXELS, box.lo.x);
  glPixelStorei(GL_UNPACK_SKIP_ROWS, box.lo.y);
  glPixelStorei(GL_UNPACK_SKIP_IMAGES, box.lo.z);
  upload(whole, box);
  for (const GLenum name : kUnpackPlaces) {
    glPixelStorei(name, 0);  // others upload too
  }
}

void VoxelTexture::upload(const void* texels, const VoxelBox& box) {
  const VoxelIndex n = box.extent();
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage3D(texture_.id(), 0, box.lo.x + kBorder, box.lo.y + kBorder, box.lo.z + kBorder,
                      n.x, n.y, n.z, format_.format, format_.type, texels);
}

glm::dvec3 texels_of(const VoxelGrid& grid) {
  return glm::dvec3(grid.nx, grid.ny, grid.nz) + 2.0 * kBorder;
}

glm::dmat4 world_from_texture(const glm::dmat4& world_from_voxel, const VoxelGrid& grid) {
  return glm::scale(glm::translate(world_from_voxel, glm::dvec3(-kBorder - 0.5)), texels_of(grid));
}

void check_extent(const VolumeView& volume, int max_texture_size) {
  const VoxelGrid& n = volume.bricks.grid;
  const int limit = max_texture_size - 2 * kBorder;
  if (std::max({n.nx, n.ny, n.nz}) <= limit) return;
  throw VisualizerError("volume " + volume.name + ": " + std::to_string(n.nx) + "x" +
                        std::to_string(n.ny) + "x" + std::to_string(n.nz) +
                        " voxels, and this OpenGL driver takes " + std::to_string(limit) +
                        " a side; crop or resample it");
}

}  // namespace kerf
