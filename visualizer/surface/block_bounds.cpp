// SPDX-License-Identifier: Apache-2.0
#include "visualizer/surface/block_bounds.hpp"

#include <algorithm>

namespace kerf {

namespace {

constexpr float kHalfVoxels = 0.5F / float{kFinePerVoxel};

bool beyond(const glm::vec4& plane, const BlockBounds& block) {
  constexpr float kSlackVox = 0.01F;  // far more than what float rounds
  const glm::vec3 normal(plane);
  const float reach = glm::dot(glm::abs(normal), block.half) + kSlackVox;
  return glm::dot(normal, block.centre) + plane.w < -reach;
}

/// Whether all triangles are seen from behind, wherever in the box they lie.
bool faces_away(const glm::vec3& eye, const BlockBounds& block) {
  constexpr float kSlack = 0.01F;  // of the distance
  const glm::vec3 to_eye = eye - block.centre;
  // The largest product of any normal with any direction in the two boxes.
  const float most = glm::dot(to_eye, block.normal_centre) +
                     glm::dot(glm::abs(to_eye) + block.half, block.normal_half) +
                     glm::dot(block.half, glm::abs(block.normal_centre));
  return most < -kSlack * glm::length(to_eye);
}

}  // namespace

BlockBounds bounds_of(const BlockMesh& mesh, VoxelIndex block) {
  if (mesh.vertices.empty()) return {};
  const auto place = [&](std::uint16_t vertex) {
    const auto& at = mesh.vertices[vertex].position;
    return glm::vec3(at[0], at[1], at[2]);
  };
  glm::vec3 low = place(0), high = low;
  for (const SurfaceVertex& vertex : mesh.vertices) {
    const glm::vec3 at(vertex.position[0], vertex.position[1], vertex.position[2]);
    low = glm::min(low, at);
    high = glm::max(high, at);
  }
  glm::vec3 normal_low(1.0F), normal_high(-1.0F);
  for (const auto& [a, b, c] : mesh.triangles) {
    const glm::vec3 normal = glm::normalize(glm::cross(place(b) - place(a), place(c) - place(a)));
    normal_low = glm::min(normal_low, normal);
    normal_high = glm::max(normal_high, normal);
  }
  const VoxelIndex start = block_start(block);
  return {.centre = glm::vec3(start.x, start.y, start.z) + kHalfVoxels * (high + low),
          .half = kHalfVoxels * (high - low),
          .normal_centre = 0.5F * (normal_high + normal_low),
          .normal_half = 0.5F * (normal_high - normal_low)};
}

Sight::Sight(const glm::dmat4& clip_from_voxel, const std::optional<glm::dvec3>& eye_voxel,
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

bool Sight::may_show(const BlockBounds& block) const {
  const auto is_beyond = [&](const glm::vec4& plane) { return beyond(plane, block); };
  if (std::any_of(around_.begin(), around_.end(), is_beyond) ||
      std::any_of(near_far_.begin(), near_far_.end(), is_beyond)) {
    return false;
  }
  return std::any_of(parts_.begin(), parts_.end(),
                     [&](const Planes& part) {
                       return std::none_of(part.begin(), part.end(), is_beyond);
                     }) &&
         !(eye_ && faces_away(*eye_, block));
}

}  // namespace kerf
