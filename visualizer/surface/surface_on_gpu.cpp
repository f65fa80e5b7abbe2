// SPDX-License-Identifier: Apache-2.0

#include "visualizer/surface/surface_on_gpu.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <numeric>

namespace kerf {

namespace {

constexpr float kSlackVox = 0.01F;  // far more than what float rounds

float reach_vox(const glm::vec4& plane, const BlockBounds& block) {
  return glm::dot(glm::abs(glm::vec3(plane)), block.half) + kSlackVox;
}

float inside_vox(const glm::vec4& plane, const BlockBounds& block) {
  return glm::dot(glm::vec3(plane), block.centre) + plane.w;
}

bool beyond(const glm::vec4& plane, const BlockBounds& block) {
  return inside_vox(plane, block) < -reach_vox(plane, block);
}

bool within(const glm::vec4& plane, const BlockBounds& block) {
  return inside_vox(plane, block) > reach_vox(plane, block);
}

/// Whether all triangles are visible from behind, wherever in the box they lie.
bool faces_away(const glm::vec3& eye, const BlockBounds& block) {
  constexpr float kSlack = 0.01F;  // of the distance
  const glm::vec3 to_eye = eye - block.centre;
  // The largest product of any normal with any direction in the two boxes.
  const float most = glm::dot(to_eye, block.normal_centre) +
                     glm::dot(glm::abs(to_eye) + block.half, block.normal_half) +
                     glm::dot(block.half, glm::abs(block.normal_centre));
  return most < -kSlack * glm::length(to_eye);
}

/// For positions of vertices, as they are, of the block that starts at `start`.
glm::vec4 seen_from(VoxelIndex start, const glm::vec4& plane) {
  const glm::vec3 normal(plane);
  return {normal / float{kFinePerVoxel},
          glm::dot(normal, glm::vec3(start.x, start.y, start.z)) + plane.w + kSlackVox};
}

/// Which vertices of a block lie beyond which planes around parts of the picture, up to eight
/// parts of four planes each: a triangle whose vertices all lie beyond one plane of a part does
/// not touch that part (Cohen and Sutherland).
class PlanesBeyond {
 public:
  PlanesBeyond(std::span<const SurfaceVertex> vertices,
               std::span<const std::array<glm::vec4, 4>> parts)
      : one_of_each_(static_cast<std::uint32_t>((std::uint64_t{1} << 4 * parts.size()) / 15)) {
    for (std::size_t first = 0; first < vertices.size(); first += kLanes) {
      Floats x{}, y{}, z{};
      for (std::size_t i = 0; i < std::min(kLanes, vertices.size() - first); ++i) {
        const auto& at = vertices[first + i].position;
        x[i] = at[0];
        y[i] = at[1];
        z[i] = at[2];
      }
      Bits planes{};
      std::uint32_t bit = 1;
      for (const auto& part : parts) {
        for (const glm::vec4& plane : part) {
          const auto is_beyond = x * plane.x + y * plane.y + z * plane.z + plane.w < 0.0F;
          planes |= reinterpret_cast<Bits>(is_beyond) & bit;
          bit <<= 1;
        }
      }
      std::memcpy(&planes_[first], &planes, sizeof(planes));
    }
  }

  /// Whether the triangle touches no part.
  [[nodiscard]] bool hide(const BlockTriangle& triangle) const {
    std::uint32_t all = planes_[triangle[0]] & planes_[triangle[1]] & planes_[triangle[2]];
    all |= all >> 1;
    all |= all >> 2;
    return (all & one_of_each_) == one_of_each_;
  }

 private:
  static constexpr std::size_t kLanes = 8;
  using Floats = float __attribute__((vector_size(kLanes * sizeof(float))));
  using Bits = std::uint32_t __attribute__((vector_size(kLanes * sizeof(std::uint32_t))));

  std::uint32_t one_of_each_;                                      ///< a bit of each part
  std::array<std::uint32_t, kMostBlockVertices + kLanes> planes_;  ///< by vertex, a bit for each
};

constexpr float kHalfVoxels = 0.5F / float{kFinePerVoxel};

}  // namespace

FrustumCulling::FrustumCulling(const glm::dmat4& clip_from_voxel,
                               const std::optional<glm::dvec3>& eye_voxel,
                               std::span<const Part> parts)
    : eye_(eye_voxel) {
  // A point shows where w*lo <= x <= w*hi and so on (Gribb and Hartmann 2001).
  const glm::dmat4 rows = glm::transpose(clip_from_voxel);
  const auto plane = [](const glm::dvec4& row) {
    return glm::vec4(row / glm::length(glm::dvec3(row)));
  };
  const auto planes = [&](const Part& part) {
    return Planes{plane(rows[0] - part.lo.x * rows[3]), plane(part.hi.x * rows[3] - rows[0]),
                  plane(rows[1] - part.lo.y * rows[3]), plane(part.hi.y * rows[3] - rows[1])};
  };
  near_far_ = {plane(rows[3] + rows[2]), plane(rows[3] - rows[2])};
  Part around{glm::dvec2(1.0), glm::dvec2(-1.0)};
  for (const Part& part : parts) {
    around = {glm::min(around.lo, part.lo), glm::max(around.hi, part.hi)};
    parts_.push_back(planes(part));
  }
  around_ = planes(around);
}

FrustumCulling::Visible FrustumCulling::visible(const BlockBounds& block) const {
  const auto is_beyond = [&](const glm::vec4& plane) { return beyond(plane, block); };
  const auto is_within = [&](const glm::vec4& plane) { return within(plane, block); };
  if (std::any_of(around_.begin(), around_.end(), is_beyond) ||
      std::any_of(near_far_.begin(), near_far_.end(), is_beyond)) {
    return Visible::nothing;
  }
  Visible most = Visible::nothing;
  for (const Planes& part : parts_) {
    if (std::any_of(part.begin(), part.end(), is_beyond)) continue;
    most = Visible::some;
    if (std::all_of(part.begin(), part.end(), is_within)) {
      most = Visible::all;
      break;
    }
  }
  return eye_ && faces_away(*eye_, block) ? Visible::nothing : most;
}

float FrustumCulling::distance_2(VoxelIndex block) const {
  if (!eye_) return 0.0F;
  const VoxelIndex start = block_start(block);
  const glm::vec3 off = glm::vec3(start.x, start.y, start.z) + 0.5F * kBlockEdge - *eye_;
  return glm::dot(off, off);
}

void FrustumCulling::append_visible(const BlockMesh& mesh, const BlockBounds& bounds,
                                    VoxelIndex block, std::vector<BlockTriangle>& visible) const {
  constexpr std::size_t kMostParts = 8;
  std::array<Planes, kMostParts> parts;
  std::size_t count = 0;
  for (const Planes& part : parts_) {
    if (std::any_of(part.begin(), part.end(),
                    [&](const glm::vec4& plane) { return beyond(plane, bounds); })) {
      continue;
    }
    if (count == kMostParts) {  // rarely: to draw more than must be is right too
      visible.insert(visible.end(), mesh.triangles.begin(), mesh.triangles.end());
      return;
    }
    std::transform(part.begin(), part.end(), parts[count++].begin(),
                   [&](const glm::vec4& plane) { return seen_from(block_start(block), plane); });
  }
  const PlanesBeyond beyond_planes(mesh.vertices, {parts.data(), count});
  const std::size_t before = visible.size();
  visible.resize(before + mesh.triangles.size());
  auto next = visible.begin() + static_cast<std::ptrdiff_t>(before);
  for (const BlockTriangle& triangle : mesh.triangles) {
    *next = triangle;
    next += beyond_planes.hide(triangle) ? 0 : 1;  // no branch: half of them are, at random
  }
  visible.erase(next, visible.end());
}

BlockBounds bounds_of(const BlockMesh& mesh, VoxelIndex block) {
  if (mesh.vertices.empty()) return {};
  const auto position = [&](std::uint16_t vertex) {
    const auto& at = mesh.vertices[vertex].position;
    return glm::vec3(at[0], at[1], at[2]);
  };
  glm::vec3 low = position(0), high = low;
  for (const SurfaceVertex& vertex : mesh.vertices) {
    const glm::vec3 at(vertex.position[0], vertex.position[1], vertex.position[2]);
    low = glm::min(low, at);
    high = glm::max(high, at);
  }
  glm::vec3 normal_low(1.0F), normal_high(-1.0F);
  for (const auto& [a, b, c] : mesh.triangles) {
    const glm::vec3 normal =
        glm::normalize(glm::cross(position(b) - position(a), position(c) - position(a)));
    normal_low = glm::min(normal_low, normal);
    normal_high = glm::max(normal_high, normal);
  }
  const VoxelIndex start = block_start(block);
  return {.centre = glm::vec3(start.x, start.y, start.z) + kHalfVoxels * (high + low),
          .half = kHalfVoxels * (high - low),
          .normal_centre = 0.5F * (normal_high + normal_low),
          .normal_half = 0.5F * (normal_high - normal_low)};
}

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
  static_assert(offsetof(SurfaceVertex, ao_factor) ==
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

void SurfaceOnGpu::find_visible(const VolumeSurface& surface, const FrustumCulling& culling) {
  seen_.clear();
  for (const std::uint32_t id : filled_) {
    const FrustumCulling::Visible shown = culling.visible(parts_[id].bounds);
    if (shown == FrustumCulling::Visible::nothing) continue;
    seen_.push_back(
        {culling.distance_2(surface.block(id)), id, shown == FrustumCulling::Visible::all});
  }
  // What is hidden by then costs no light. The positions of blocks never change, nor does their
  // order.
  std::sort(seen_.begin(), seen_.end());
}

void SurfaceOnGpu::draw(const VolumeSurface& surface, const FrustumCulling& culling) {
  find_visible(surface, culling);
  commands_.clear();
  picked_.clear();
  of_picked_.clear();
  for (const auto& [distance_2, id, all] : seen_) {
    const Part& part = parts_[id];
    DrawCommand command{part.count * kIndices, 1, part.triangles.first * kIndices,
                        part.vertices.first, id};
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
                    static_cast<GLsizeiptr>(commands_.size() * sizeof(DrawCommand)),
                    commands_.data(), GL_STREAM_DRAW);
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
