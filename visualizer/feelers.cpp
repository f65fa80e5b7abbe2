// SPDX-License-Identifier: Apache-2.0
#include "visualizer/feelers.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <glm/gtc/matrix_inverse.hpp>

namespace kerf {

namespace {

constexpr std::array<float, 2> kFeelersVox{6.0F, 12.0F};  // iso.frag; that of 2.5 is no far one
// A texture unit may filter with 8 bits of weight: on this steep a slope (of 4, from air to full
// density) the normal of a shader is off by less than 1/24, half a voxel at the end of a feeler.
constexpr float kLeastSlope = 0.5F;
constexpr float kSlackVox = 0.5F;

VoxelBox united(std::span<const VoxelBox> boxes) {
  VoxelBox all;
  for (const VoxelBox& box : boxes) all = all.united(box);
  return all;
}

}  // namespace

bool Feelers::Box::contains(const glm::vec3& p) const {
  return p.x >= lo.x && p.y >= lo.y && p.z >= lo.z && p.x <= hi.x && p.y <= hi.y && p.z <= hi.z;
}

Feelers::Feelers(const VolumeView& volume, std::span<const Density> density,
                 std::span<const VoxelBox> differs, const View& view, PictureSize size)
    : grid_(volume.bricks.grid),
      density_(density),
      near_mm_(static_cast<float>(view.near_mm)),
      far_mm_(static_cast<float>(view.far_mm)) {
  const glm::dmat4 eye_from_voxel = view.eye_from_world * volume.world_from_voxel;
  const glm::dmat4 voxel_from_eye = glm::affineInverse(eye_from_voxel);
  voxel_from_eye_ = glm::mat3(voxel_from_eye);
  origin_ = glm::vec3(voxel_from_eye[3]);
  const glm::dvec2 half(view.tan_half_height * view.aspect, view.tan_half_height);
  direction_per_pixel_ = 2.0 * half / glm::dvec2(size.width, size.height);
  const glm::vec2 middle(view.middle_right, 0.0);
  first_direction_ = middle + 0.5F * direction_per_pixel_ - glm::vec2(half);
  const auto box_around = [](const VoxelBox& box, float by) {
    return Box{glm::vec3(box.lo.x, box.lo.y, box.lo.z) - by,
               glm::vec3(box.hi.x - 1, box.hi.y - 1, box.hi.z - 1) + by};
  };
  for (const VoxelBox& box : differs) ends_.push_back(box_around(box, 1.0F + kSlackVox));
  const VoxelBox all = united(differs);
  within_ = box_around(all, static_cast<float>(kReachVox) + kSlackVox);
  const Box end = box_around(all, 1.0F + kSlackVox);
  eye_centre_ = glm::vec3(eye_from_voxel * glm::dvec4(0.5F * (end.lo + end.hi), 1.0));
  for (int axis = 0; axis < 3; ++axis) {
    eye_half_[axis] = 0.5F * (end.hi - end.lo)[axis] * glm::vec3(eye_from_voxel[axis]);
  }
}

bool Feelers::may_reach(int x, int y, float window_depth) const {
  const glm::vec3 direction(first_direction_ + glm::vec2(x, y) * direction_per_pixel_, -1.0F);
  // The inverse of equation (1), as in lighting.frag.
  const float t = 2.0F * far_mm_ * near_mm_ /
                  (far_mm_ + near_mm_ - (2.0F * window_depth - 1.0F) * (far_mm_ - near_mm_));
  const glm::vec3 at = origin_ + t * (voxel_from_eye_ * direction);
  if (!within_.contains(at)) return false;
  // Normals are turned towards the eye, and so is what they point at.
  float nearest = glm::dot(eye_centre_, -direction);
  for (const glm::vec3& half : eye_half_) nearest += std::abs(glm::dot(half, direction));
  if (nearest < -t * glm::dot(direction, direction)) return false;

  const glm::vec3 gradient = gradient_at(at);
  if (glm::dot(gradient, gradient) < kLeastSlope * kLeastSlope) return true;
  // As in iso.frag: by the transposed Jacobian to the eye's millimetres, turned, and back.
  glm::vec3 normal = -glm::normalize(gradient * voxel_from_eye_);
  const glm::vec3 to_eye = -glm::normalize(direction);
  const float facing = glm::dot(normal, to_eye);
  if (facing < 0.0F) normal = glm::normalize(normal - 1.02F * facing * to_eye);
  const glm::vec3 outward = glm::normalize(voxel_from_eye_ * normal);
  return std::any_of(kFeelersVox.begin(), kFeelersVox.end(), [&](float reach) {
    const glm::vec3 end = at + reach * outward;
    return std::any_of(ends_.begin(), ends_.end(),
                       [&](const Box& box) { return box.contains(end); });
  });
}

/// From the eight corners of a cube two voxels wide, as `gradient_at` in iso.frag, 1 = full
/// density.
glm::vec3 Feelers::gradient_at(const glm::vec3& voxel) const {
  const glm::vec3 low = glm::floor(voxel);
  const glm::vec3 share = voxel - low;
  const glm::ivec3 first = glm::ivec3(low) - 1;
  // Along x, then y, then z, of the 4^3 voxels around: the sum of both ends, and their difference.
  std::array<glm::vec3, 4> layer{};  // by z: difference along x, difference along y, sum
  for (int z = 0; z < 4; ++z) {
    std::array<glm::vec2, 4> row{};  // by y: difference along x, sum
    for (int y = 0; y < 4; ++y) {
      std::array<float, 4> d{};
      const VoxelIndex at{first.x, first.y + y, first.z + z};
      for (int x = 0; x < 4; ++x) {
        const VoxelIndex v{at.x + x, at.y, at.z};
        if (grid_.contains(v)) {
          d[static_cast<std::size_t>(x)] =
              static_cast<float>(density_[grid_.index(v.x, v.y, v.z)]) /
              static_cast<float>(kDensityMax);
        }
      }
      const float before = glm::mix(d[0], d[1], share.x);
      const float behind = glm::mix(d[2], d[3], share.x);
      row[static_cast<std::size_t>(y)] = {behind - before, behind + before};
    }
    const glm::vec2 before = glm::mix(row[0], row[1], share.y);
    const glm::vec2 behind = glm::mix(row[2], row[3], share.y);
    layer[static_cast<std::size_t>(z)] = {before.x + behind.x, behind.y - before.y,
                                          before.y + behind.y};
  }
  const glm::vec3 before = glm::mix(layer[0], layer[1], share.z);
  const glm::vec3 behind = glm::mix(layer[2], layer[3], share.z);
  return {before.x + behind.x, before.y + behind.y, behind.z - before.z};
}

}  // namespace kerf
