// SPDX-License-Identifier: Apache-2.0

#include "visualizer/render/translucent_volumes.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <glm/gtc/matrix_inverse.hpp>

#include "visualizer/gl/context.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf {

namespace {

constexpr TexelFormat kTexel{GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, GL_LINEAR};
constexpr int kOtherUnits = 3;  // materials by density, where rays enter, depth of opaque things

void check_units(std::size_t volumes) {
  GLint units = 0;
  glGetIntegerv(GL_MAX_TEXTURE_IMAGE_UNITS, &units);
  const auto limit =
      static_cast<std::size_t>(units - kOtherUnits) / TranslucentVolumes::kUnitsPerVolume;
  if (volumes <= limit) return;
  throw VisualizerError("renderer: " + std::to_string(volumes) +
                        " volumes, and this OpenGL driver has texture units for " +
                        std::to_string(limit) + " translucent ones; take --renderer iso");
}

std::string element(const char* array, std::size_t i) {
  return array + ("[" + std::to_string(i) + "]");
}

}  // namespace

TranslucentVolume::TranslucentVolume(const VolumeView& volume, const VolumeContent& content,
                                     const TransferFunction& transfer, GradientFilter gradient,
                                     int max_texture_size, bool skip_empty)
    : bricks_((check_extent(volume, max_texture_size), volume.bricks)),
      has_labels_(!content.labels.empty()),
      transfer_(transfer),
      gradient_(gradient, volume.edges_mm()),
      world_from_texture_(kerf::world_from_texture(volume.world_from_voxel, volume.bricks.grid)),
      edge_mm_(shortest_edge_mm(volume.world_from_voxel)),
      voxels_(bricks_.grid, kTexel, &kAirTexel),
      materials_(has_labels_ ? bricks_.grid : VoxelGrid{}, kTexel),
      cells_(volume, content.density, skip_empty ? transfer.lowest_seen() : Density{0}) {
  set_materials(transfer.materials, content);
  for_each_layer(bricks_.grid, [&](const VoxelBox& layer) { upload(content.density, layer); });
}

void TranslucentVolume::set_materials(const Palette& materials, const VolumeContent& content) {
  transfer_.materials = materials;
  if (!has_labels_) return;
  material_texels_.emplace(bricks_.grid, content.labels, materials);
  materials_.upload(material_texels_->of_all(content.density).data(), bricks_.grid.box());
}

void TranslucentVolume::upload(std::span<const Density> density, const VoxelBox& box) {
  fill_gradient_texels(gradient_, bricks_.grid, density, box, upload_buffer_);
  voxels_.upload(upload_buffer_.data(), box);
}

void TranslucentVolume::update_bricks(std::span<const Density> density,
                                      const ChangedBricks& changed) {
  for (const VoxelBox& box : gradient_.around(changed, bricks_)) upload(density, box);
  for (const ChangedBrick& one : changed) {
    if (!material_texels_) break;
    const VoxelBox brick = bricks_.voxels(one.id);
    // A voxel without a label has the material of its density.
    materials_.upload(material_texels_->of(brick, density).data(), brick);
  }
  cells_.update_bricks(density, changed);
}

void TranslucentVolume::set_transform(const glm::dmat4& world_from_voxel) {
  world_from_texture_ = kerf::world_from_texture(world_from_voxel, bricks_.grid);
  cells_.set_transform(world_from_voxel);
}

void TranslucentVolume::bind_textures(GLuint unit) const {
  voxels_.bind(unit);
  materials_.bind(unit + 1);
  cells_.bind(unit + 2);
}

TranslucentVolumes::TranslucentVolumes(const SceneView& scene,
                                       std::span<const VolumeContent> contents, bool skip_empty) {
  check_units(scene.volumes.size());
  const int limit = query_gl_driver().max_texture_size_3d;
  volumes_.reserve(scene.volumes.size());
  const auto rows = static_cast<GLsizei>(scene.volumes.size());
  glTextureStorage2D(by_density_.id(), 1, GL_RGBA32F, kPaletteWidth, rows);
  read_nearest(by_density_.id());
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    const TransferFunction transfer = make_transfer_function(scene, v, contents[v]);
    volumes_.emplace_back(scene.volumes[v], contents[v], transfer, scene.gradient, limit,
                          skip_empty);
    upload_materials(v);
  }
}

void TranslucentVolumes::upload_materials(std::size_t volume) {
  glTextureSubImage2D(by_density_.id(), 0, 0, static_cast<GLint>(volume), kPaletteWidth, 1, GL_RGBA,
                      GL_FLOAT, volumes_[volume].transfer().materials[0].data());
}

void TranslucentVolumes::set_opacities(std::span<const MaterialView> materials,
                                       std::span<const VolumeContent> contents) {
  const Palette palette = make_palette(materials);
  for (std::size_t v = 0; v < volumes_.size(); ++v) {
    volumes_[v].set_materials(palette, contents[v]);
    upload_materials(v);
  }
}

std::string TranslucentVolumes::defines() const {
  std::string each;
  std::string labels;
  for (std::size_t v = 0; v < volumes_.size(); ++v) {
    each += " f(" + std::to_string(v) + ")";
    labels += (v == 0 ? "" : ", ") + std::string(volumes_[v].has_labels() ? "true" : "false");
  }
  return "#define KERF_VOLUMES " + std::to_string(volumes_.size()) +
         "\n#define KERF_EACH_VOLUME(f)" + each +  //
         "\n#define KERF_HAS_LABELS bool[](" + labels + ")\n";
}

GLuint TranslucentVolumes::free_unit() const noexcept {
  return static_cast<GLuint>(volumes_.size()) * kUnitsPerVolume + 1;
}

void TranslucentVolumes::set_constants(const GlProgram& program) const {
  for (std::size_t v = 0; v < volumes_.size(); ++v) {
    const TranslucentVolume& volume = volumes_[v];
    const int unit = static_cast<int>(v * kUnitsPerVolume);
    program.set(element("u_voxel", v), unit);
    program.set(element("u_material", v), unit + 1);
    program.set(element("u_active_cell", v), unit + 2);
    program.set(element("u_texels", v), glm::vec3(volume.texels()));
    const TransferFunction& transfer = volume.transfer();
    program.set(element("u_fade", v), glm::vec2(transfer.empty, transfer.full));
    program.set(element("u_surface_mm", v),
                static_cast<float>(volume.gradient().surface_mm + transfer.border_mm));
  }
  program.set("u_least_extinction",
              static_cast<float>(-std::log2(1.0 - kLeastOpacity) / kOpacityMm));
  program.set("u_by_density", static_cast<int>(free_unit()) - 1);
}

void TranslucentVolumes::bind(const GlProgram& program, const View& view) const {
  for (std::size_t v = 0; v < volumes_.size(); ++v) {
    const TranslucentVolume& volume = volumes_[v];
    volume.bind_textures(static_cast<GLuint>(v) * kUnitsPerVolume);
    const glm::dmat4 texture_from_eye =
        glm::affineInverse(view.eye_from_world * volume.world_from_texture());
    program.set(element("u_texture_from_eye", v), glm::mat4(texture_from_eye));
    // A gradient per voxel edge goes to the eye's millimetres by the transposed Jacobian.
    glm::dmat3 eye_from_gradient = glm::transpose(glm::dmat3(texture_from_eye));
    const glm::dvec3 scale = volume.texels() * glm::dvec3(volume.gradient().per_edge);
    for (int axis = 0; axis < 3; ++axis) eye_from_gradient[axis] *= scale[axis];
    program.set(element("u_eye_from_gradient", v), glm::mat3(eye_from_gradient));
  }
  glBindTextureUnit(free_unit() - 1, by_density_.id());
}

double TranslucentVolumes::edge_mm() const noexcept {
  const auto shortest = std::min_element(
      volumes_.begin(), volumes_.end(), [](const TranslucentVolume& a, const TranslucentVolume& b) {
        return a.edge_mm() < b.edge_mm();
      });
  return shortest->edge_mm();
}

TranslucentLayer::Buffer::Buffer(PictureSize of_size) : size(of_size) {
  glTextureStorage2D(colour.id(), 1, GL_RGBA16F, size.width, size.height);
  glTextureStorage2D(depth.id(), 1, GL_R32F, size.width, size.height);
  for (const GlTexture2D* texture : {&colour, &depth}) read_nearest(texture->id());
  glNamedFramebufferTexture(framebuffer.id(), GL_COLOR_ATTACHMENT0, colour.id(), 0);
  glNamedFramebufferTexture(framebuffer.id(), GL_COLOR_ATTACHMENT1, depth.id(), 0);
  constexpr std::array<GLenum, 2> kOutputs{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  glNamedFramebufferDrawBuffers(framebuffer.id(), kOutputs.size(), kOutputs.data());
}

void TranslucentLayer::begin(const RenderTarget& target) {
  const PictureSize size = target.size();
  if (!buffer_ || buffer_->size != size) buffer_.emplace(size);
  constexpr std::array<float, 4> kNothing{};
  constexpr std::array<float, 4> kFarthest{1.0F};
  target.bind();
  glBindFramebuffer(GL_FRAMEBUFFER, buffer_->framebuffer.id());
  target.for_parts([&] {
    glClearBufferfv(GL_COLOR, 0, kNothing.data());
    glClearBufferfv(GL_COLOR, 1, kFarthest.data());
  });
  glViewport(0, 0, size.width, size.height);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
}

void TranslucentLayer::finish(const RenderTarget& target) {
  target.bind();
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDisable(GL_CULL_FACE);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_ONE, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
  glBindTextureUnit(0, buffer_->colour.id());
  glBindTextureUnit(1, buffer_->depth.id());
  program_.set("u_colour", 0);
  program_.set("u_depth", 1);
  program_.use();
  target.cover();
  glDisable(GL_BLEND);
}

}  // namespace kerf
