// SPDX-License-Identifier: Apache-2.0
#include "visualizer/surface/surface_on_gpu.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace kerf {

namespace {

using BlockStart = std::array<std::uint16_t, 4>;  // the fourth for alignment
constexpr std::uint32_t kIndices = 3;             // of a triangle
constexpr GLuint kVertexBinding = 0;
constexpr GLuint kBlockBinding = 1;

void describe(GLuint array, GLuint attribute, GLint parts, GLenum type, GLboolean to_one,
              std::size_t offset, GLuint binding) {
  glEnableVertexArrayAttrib(array, attribute);
  glVertexArrayAttribFormat(array, attribute, parts, type, to_one, static_cast<GLuint>(offset));
  glVertexArrayAttribBinding(array, attribute, binding);
}

}  // namespace

bool GrowingBuffer::reserve(std::size_t bytes) {
  if (bytes <= bytes_) return false;
  const std::size_t room = std::max(bytes, bytes_ + bytes_ / 2);
  GlBuffer larger = GlBuffer::create();
  glNamedBufferData(larger.id(), static_cast<GLsizeiptr>(room), nullptr, GL_DYNAMIC_DRAW);
  if (bytes_ != 0) {
    glCopyNamedBufferSubData(buffer_.id(), larger.id(), 0, 0, static_cast<GLsizeiptr>(bytes_));
  }
  buffer_ = std::move(larger);
  bytes_ = room;
  return true;
}

void GrowingBuffer::write(std::size_t offset, std::size_t bytes, const void* data) const {
  glNamedBufferSubData(buffer_.id(), static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(bytes),
                       data);
}

SurfaceOnGpu::SurfaceOnGpu(const VolumeSurface& surface) : parts_(surface.meshes().size()) {
  std::vector<BlockStart> starts;
  starts.reserve(parts_.size());
  for (std::uint32_t id = 0; id < parts_.size(); ++id) {
    const VoxelIndex at = surface.block(id);
    starts.push_back({static_cast<std::uint16_t>(at.x), static_cast<std::uint16_t>(at.y),
                      static_cast<std::uint16_t>(at.z), 0});
  }
  glNamedBufferData(starts_.id(), static_cast<GLsizeiptr>(starts.size() * sizeof(BlockStart)),
                    starts.data(), GL_STATIC_DRAW);
  glVertexArrayVertexBuffer(array_.id(), kBlockBinding, starts_.id(), 0, sizeof(BlockStart));
  glVertexArrayBindingDivisor(array_.id(), kBlockBinding, 1);
  describe(array_.id(), 0, 3, GL_UNSIGNED_SHORT, GL_FALSE, offsetof(SurfaceVertex, position),
           kVertexBinding);
  describe(array_.id(), 1, 3, GL_SHORT, GL_TRUE, offsetof(SurfaceVertex, normal), kVertexBinding);
  static_assert(offsetof(SurfaceVertex, openness) ==
                offsetof(SurfaceVertex, colour) + 3 * sizeof(std::uint16_t));
  describe(array_.id(), 2, 4, GL_UNSIGNED_SHORT, GL_TRUE, offsetof(SurfaceVertex, colour),
           kVertexBinding);
  describe(array_.id(), 3, 3, GL_UNSIGNED_SHORT, GL_FALSE, 0, kBlockBinding);

  std::vector<std::uint32_t> all(parts_.size());
  std::iota(all.begin(), all.end(), 0U);
  update(surface, all);
}

void SurfaceOnGpu::update(const VolumeSurface& surface, std::span<const std::uint32_t> blocks) {
  for (const std::uint32_t id : blocks) {
    const BlockMesh& mesh = surface.meshes()[id];
    Part& part = parts_[id];
    if (mesh.triangles.empty() != (part.count == 0)) {
      const auto at = std::lower_bound(filled_.begin(), filled_.end(), id);
      if (part.count == 0) {
        filled_.insert(at, id);
      } else {
        filled_.erase(at);
      }
    }
    part.bounds = bounds_of(mesh, surface.block(id));
    part.count = static_cast<std::uint32_t>(mesh.triangles.size());
    part.vertices =
        vertex_pool_.fit(part.vertices, static_cast<std::uint32_t>(mesh.vertices.size()));
    part.triangles = triangle_pool_.fit(part.triangles, part.count);
  }
  grow();
  for (const std::uint32_t id : blocks) {
    const BlockMesh& mesh = surface.meshes()[id];
    if (mesh.triangles.empty()) continue;
    const Part& part = parts_[id];
    vertices_.write(part.vertices.first * sizeof(SurfaceVertex),
                    mesh.vertices.size() * sizeof(SurfaceVertex), mesh.vertices.data());
    triangles_.write(part.triangles.first * sizeof(BlockTriangle),
                     part.count * sizeof(BlockTriangle), mesh.triangles.data());
  }
}

void SurfaceOnGpu::grow() {
  if (vertices_.reserve(vertex_pool_.size() * sizeof(SurfaceVertex))) {
    glVertexArrayVertexBuffer(array_.id(), kVertexBinding, vertices_.id(), 0,
                              sizeof(SurfaceVertex));
  }
  if (triangles_.reserve(triangle_pool_.size() * sizeof(BlockTriangle))) {
    glVertexArrayElementBuffer(array_.id(), triangles_.id());
  }
}

void SurfaceOnGpu::look_from(const VolumeSurface& surface, const FrustumCulling& culling) {
  seen_.clear();
  for (const std::uint32_t id : filled_) {
    const FrustumCulling::Visible shown = culling.visible(parts_[id].bounds);
    if (shown == FrustumCulling::Visible::nothing) continue;
    seen_.push_back(
        {culling.distance_2(surface.block(id)), id, shown == FrustumCulling::Visible::all});
  }
  // What is hidden by then costs no light. The places of blocks never change, nor does their order.
  std::sort(seen_.begin(), seen_.end());
}

void SurfaceOnGpu::draw(const VolumeSurface& surface, const FrustumCulling& culling) {
  look_from(surface, culling);
  commands_.clear();
  picked_.clear();
  of_picked_.clear();
  for (const auto& [distance_2, id, all] : seen_) {
    const Part& part = parts_[id];
    Command command{part.count * kIndices, 1, part.triangles.first * kIndices, part.vertices.first,
                    id};
    if (!all) {
      const std::size_t before = picked_.size();
      culling.append_visible(surface.meshes()[id], part.bounds, surface.block(id), picked_);
      if (picked_.size() == before) continue;
      command.indices = static_cast<std::uint32_t>(picked_.size() - before) * kIndices;
      command.first_index = static_cast<std::uint32_t>(before) * kIndices;
      of_picked_.push_back(commands_.size());
    }
    commands_.push_back(command);
  }
  if (commands_.empty()) return;
  upload_picked();
  glNamedBufferData(command_buffer_.id(),
                    static_cast<GLsizeiptr>(commands_.size() * sizeof(Command)), commands_.data(),
                    GL_STREAM_DRAW);
  glBindBuffer(GL_DRAW_INDIRECT_BUFFER, command_buffer_.id());
  glBindVertexArray(array_.id());
  glMultiDrawElementsIndirect(GL_TRIANGLES, GL_UNSIGNED_SHORT, nullptr,
                              static_cast<GLsizei>(commands_.size()), 0);
  glBindBuffer(GL_DRAW_INDIRECT_BUFFER, 0);
}

void SurfaceOnGpu::upload_picked() {
  if (picked_.empty()) return;
  picked_range_ = triangle_pool_.fit(picked_range_, static_cast<std::uint32_t>(picked_.size()));
  grow();
  triangles_.write(picked_range_.first * sizeof(BlockTriangle),
                   picked_.size() * sizeof(BlockTriangle), picked_.data());
  for (const std::size_t i : of_picked_) {
    commands_[i].first_index += picked_range_.first * kIndices;
  }
}

}  // namespace kerf
