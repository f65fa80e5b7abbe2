// SPDX-License-Identifier: Apache-2.0

#include "visualizer/render/volume_textures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <glm/gtc/matrix_inverse.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "shared/volume/brick_grid.hpp"
#include "shared/volume/voxel_grid.hpp"
#include "visualizer/scene/appearance.hpp"
#include "visualizer/scene/visualizer_error.hpp"

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

void VoxelTexture::upload_from(const void* whole, const VoxelBox& box, int border) {
  glPixelStorei(GL_UNPACK_ROW_LENGTH, grid_.nx + 2 * border);
  glPixelStorei(GL_UNPACK_IMAGE_HEIGHT, grid_.ny + 2 * border);
  glPixelStorei(GL_UNPACK_SKIP_PIXELS, box.lo.x + border);
  glPixelStorei(GL_UNPACK_SKIP_ROWS, box.lo.y + border);
  glPixelStorei(GL_UNPACK_SKIP_IMAGES, box.lo.z + border);
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

namespace {

constexpr std::int32_t kMaterialReach = 2;  // voxels; a border is antialiased over two

/// 128.5 is the middle of what becomes 128.
std::uint8_t gradient_byte(float gradient) noexcept {
  return static_cast<std::uint8_t>(gradient * 127.0F + 128.5F);
}

std::uint8_t density_byte(std::int32_t density) noexcept {
  return static_cast<std::uint8_t>((density * 255 + 32767) / 65535);
}

std::uint8_t unit_byte(double value) noexcept {
  return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 1.0) * 255.0));
}

MaterialTexel texel_of(const glm::vec4& material) noexcept {
  const glm::dvec4 v(material);
  return {unit_byte(v.r), unit_byte(v.g), unit_byte(v.b), unit_byte(v.a)};
}

}  // namespace

void fill_gradient_texels(const GradientPlan& plan, const VoxelGrid& grid,
                          std::span<const Density> density, const VoxelBox& box,
                          std::vector<GradientTexel>& texels) {
  std::vector<glm::vec3> gradients;
  fill_gradients(plan, grid, density, box, gradients);
  texels.clear();
  texels.reserve(gradients.size());
  auto gradient = gradients.begin();
  for_each_voxel(box, [&](int x, int y, int z) {
    const glm::vec3& g = *gradient++;
    texels.push_back({gradient_byte(g.x), gradient_byte(g.y), gradient_byte(g.z),
                      density_byte(density[grid.index(x, y, z)])});
  });
}

MaterialTexels::MaterialTexels(const VoxelGrid& grid, std::span<const Label> labels,
                               const Palette& palette)
    : grid_(grid), labels_(labels), label_materials_(palette[1]) {
  for (std::size_t i = 0; i < kPaletteWidth; ++i) {
    by_density_[i] = texel_of(palette[0][i]);
    by_label_[i] = texel_of(palette[1][i]);
  }
}

bool MaterialTexels::any_label(const VoxelBox& box) const {
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      const auto row = labels_.subspan(grid_.index(box.lo.x, y, z),
                                       static_cast<std::size_t>(box.hi.x - box.lo.x));
      if (std::any_of(row.begin(), row.end(), [](Label l) { return l != 0; })) return true;
    }
  }
  return false;
}

/// The mean of the labelled voxels around `at`, the nearer the heavier; none if there are none.
std::optional<glm::vec4> MaterialTexels::mean_around(VoxelIndex at) const {
  const VoxelBox box =
      VoxelBox{at, {at.x + 1, at.y + 1, at.z + 1}}.grown(kMaterialReach).clipped(grid_.box());
  glm::vec4 sum(0.0F);
  float weights = 0.0F;
  for_each_voxel(box, [&](int x, int y, int z) {
    const Label label = labels_[grid_.index(x, y, z)];
    if (label == 0) return;
    const glm::ivec3 d(x - at.x, y - at.y, z - at.z);
    const float weight = 1.0F / static_cast<float>(d.x * d.x + d.y * d.y + d.z * d.z);
    sum += weight * label_materials_[label];
    weights += weight;
  });
  if (weights == 0.0F) return std::nullopt;
  return sum / weights;
}

template <class Put>
void MaterialTexels::each(const VoxelBox& box, std::span<const Density> density,
                          const Put& put) const {
  const bool near_labels = any_label(box.grown(kMaterialReach).clipped(grid_.box()));
  for_each_voxel(box, [&](int x, int y, int z) {
    const std::size_t at = grid_.index(x, y, z);
    if (labels_[at] != 0) return put(at, by_label_[labels_[at]]);
    const auto mean = near_labels ? mean_around({x, y, z}) : std::nullopt;
    put(at, mean ? texel_of(*mean) : by_density_[density_byte(density[at])]);
  });
}

std::vector<MaterialTexel> MaterialTexels::of(const VoxelBox& box,
                                              std::span<const Density> density) const {
  std::vector<MaterialTexel> texels;
  each(box, density, [&](std::size_t, const MaterialTexel& texel) { texels.push_back(texel); });
  return texels;
}

std::vector<MaterialTexel> MaterialTexels::of_all(std::span<const Density> density) const {
  std::vector<MaterialTexel> texels(grid_.voxel_count());
  const BrickGrid bricks = BrickGrid::of(grid_);
  for (std::uint32_t id = 0; id < bricks.count(); ++id) {
    each(bricks.voxels(id), density,
         [&](std::size_t at, const MaterialTexel& texel) { texels[at] = texel; });
  }
  return texels;
}

namespace {

constexpr TexelFormat kDensityTexel{GL_R16, GL_RED, GL_UNSIGNED_SHORT, GL_LINEAR};
constexpr TexelFormat kLabelTexel{GL_R8UI, GL_RED_INTEGER, GL_UNSIGNED_BYTE, GL_NEAREST};
constexpr GLuint kDensityUnit = 0;
constexpr GLuint kLabelUnit = 1;

const VoxelGrid& checked_grid(const VolumeView& volume, int max_texture_size) {
  check_extent(volume, max_texture_size);
  return volume.bricks.grid;
}

}  // namespace

SolidOnGpu::SolidOnGpu(const VolumeView& volume, const VolumeContent& content, int max_texture_size)
    : bricks_(volume.bricks),
      has_labels_(!content.labels.empty()),
      iso_(static_cast<float>(volume.iso / kDensityMax)),
      world_from_texture_(kerf::world_from_texture(volume.world_from_voxel, volume.bricks.grid)),
      density_(checked_grid(volume, max_texture_size), kDensityTexel),
      labels_(has_labels_ ? bricks_.grid : VoxelGrid{}, kLabelTexel) {
  const VoxelBox whole = bricks_.grid.box();
  density_.upload_from(content.density.data(), whole);
  if (has_labels_) labels_.upload_from(content.labels.data(), whole);
}

void SolidOnGpu::update_bricks(std::span<const Density> density, const ChangedBricks& changed) {
  for (const ChangedBrick& brick : changed) {
    density_.upload_from(density.data(), bricks_.voxels(brick.id));
  }
}

void SolidOnGpu::set_transform(const glm::dmat4& world_from_voxel) {
  world_from_texture_ = kerf::world_from_texture(world_from_voxel, bricks_.grid);
}

void SolidOnGpu::set_units(const GlProgram& program, int palette) {
  program.set("u_density", static_cast<int>(kDensityUnit));
  program.set("u_label", static_cast<int>(kLabelUnit));
  program.set("u_palette", palette);
}

void SolidOnGpu::bind(const GlProgram& program, const View& view) const {
  density_.bind(kDensityUnit);
  labels_.bind(kLabelUnit);
  const glm::dmat4 texture_from_eye = glm::affineInverse(view.eye_from_world * world_from_texture_);
  program.set("u_texture_from_eye", glm::mat4(texture_from_eye));
  program.set("u_texels", glm::vec3(texels_of(bricks_.grid)));
  program.set("u_iso", iso_);
  program.set("u_has_labels", has_labels_ ? 1 : 0);
}

GlTexture2D palette_texture(std::span<const MaterialView> materials) {
  const Palette palette = make_palette(materials);
  GlTexture2D texture = GlTexture2D::create();
  glTextureStorage2D(texture.id(), 1, GL_RGBA32F, kPaletteWidth, 2);
  glTextureSubImage2D(texture.id(), 0, 0, 0, kPaletteWidth, 2, GL_RGBA, GL_FLOAT, palette.data());
  glTextureParameteri(texture.id(), GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTextureParameteri(texture.id(), GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTextureParameteri(texture.id(), GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return texture;
}

}  // namespace kerf
