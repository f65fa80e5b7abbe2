// SPDX-License-Identifier: Apache-2.0
#include "visualizer/feelers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include <glm/gtc/matrix_inverse.hpp>

namespace kerf {

namespace {

// Outwards; iso.frag.
constexpr std::array<float, 6> kFeelersVox{-2.5F, -1.25F, 1.25F, 2.5F, 6.0F, 12.0F};
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
  any_end_ = box_around(all, 1.0F + kSlackVox);
  eye_centre_ = glm::vec3(eye_from_voxel * glm::dvec4(0.5F * (any_end_.lo + any_end_.hi), 1.0));
  for (int axis = 0; axis < 3; ++axis) {
    longest_edge_mm_ = std::max(longest_edge_mm_, glm::length(glm::vec3(eye_from_voxel[axis])));
    eye_half_[axis] = 0.5F * (any_end_.hi - any_end_.lo)[axis] * glm::vec3(eye_from_voxel[axis]);
  }
}

glm::vec3 Feelers::direction(int x, int y) const {
  return {first_direction_ + glm::vec2(x, y) * direction_per_pixel_, -1.0F};
}

/// The inverse of equation (1), as in lighting.frag.
float Feelers::eye_mm(float window_depth) const {
  return 2.0F * far_mm_ * near_mm_ /
         (far_mm_ + near_mm_ - (2.0F * window_depth - 1.0F) * (far_mm_ - near_mm_));
}

bool Feelers::may_reach(const PixelRect& tile, float nearest, float farthest) const {
  glm::vec3 low(std::numeric_limits<float>::max()), high(-low);
  float behind_mm = 0.0F, before_mm = std::numeric_limits<float>::max();
  const float near_mm = eye_mm(nearest), far_mm = eye_mm(farthest);
  for (int corner = 0; corner < 4; ++corner) {
    const glm::vec3 along = direction((corner & 1) != 0 ? tile.x1 - 1 : tile.x0,
                                      (corner & 2) != 0 ? tile.y1 - 1 : tile.y0);
    const glm::vec3 per_mm = voxel_from_eye_ * along;
    for (const float t : {near_mm, far_mm}) {
      low = glm::min(low, origin_ + t * per_mm);
      high = glm::max(high, origin_ + t * per_mm);
    }
    behind_mm = std::max(behind_mm, seen_from(along, far_mm));
    before_mm = std::min(before_mm, nearest_end(along));
  }
  return behind_mm >= before_mm && glm::all(glm::lessThanEqual(low, within_.hi)) &&
         glm::all(glm::greaterThanEqual(high, within_.lo));
}

/// How far along a ray, up to a factor that is the ray's, what a point at `t` feels begins: normals
/// are turned towards the eye, so that is what lies before the point, and a little behind it.
float Feelers::seen_from(const glm::vec3& along, float t) const {
  constexpr float kInwardsVox = -kFeelersVox.front();
  return t * glm::dot(along, along) + kInwardsVox * longest_edge_mm_ * glm::length(along);
}

/// How far along a ray, up to the same factor, the nearest of all ends may be.
float Feelers::nearest_end(const glm::vec3& along) const {
  float nearest = glm::dot(eye_centre_, along);
  for (const glm::vec3& half : eye_half_) nearest -= std::abs(glm::dot(half, along));
  return nearest;
}

bool Feelers::may_reach(int x, int y, float window_depth) const {
  const glm::vec3 along = direction(x, y);
  const float t = eye_mm(window_depth);
  const glm::vec3 at = origin_ + t * (voxel_from_eye_ * along);
  const glm::vec3 away = glm::max(glm::max(any_end_.lo - at, at - any_end_.hi), glm::vec3(0.0F));
  constexpr float kLongest = kFeelersVox.back();
  if (glm::dot(away, away) > kLongest * kLongest) return false;
  if (seen_from(along, t) < nearest_end(along)) return false;

  const glm::vec3 gradient = gradient_at(at);
  if (glm::dot(gradient, gradient) < kLeastSlope * kLeastSlope) return true;
  // As in iso.frag: by the transposed Jacobian to the eye's millimetres, turned, and back.
  glm::vec3 normal = -glm::normalize(gradient * voxel_from_eye_);
  const glm::vec3 to_eye = -glm::normalize(along);
  const float facing = glm::dot(normal, to_eye);
  if (facing < 0.0F) normal = glm::normalize(normal - 1.02F * facing * to_eye);
  const glm::vec3 outward = glm::normalize(voxel_from_eye_ * normal);
  return std::any_of(kFeelersVox.begin(), kFeelersVox.end(), [&](float reach) {
    const glm::vec3 end = at + reach * outward;
    return any_end_.contains(end) && std::any_of(ends_.begin(), ends_.end(),
                                                 [&](const Box& box) { return box.contains(end); });
  });
}

/// From the eight corners of a cube two voxels wide, as `gradient_at` in iso.frag, in full
/// densities.
glm::vec3 Feelers::gradient_at(const glm::vec3& voxel) const {
  using Row = float __attribute__((vector_size(16)));
  using Densities = Density __attribute__((vector_size(8)));
  const glm::vec3 low = glm::floor(voxel);
  const VoxelIndex first{static_cast<int>(low.x) - 1, static_cast<int>(low.y) - 1,
                         static_cast<int>(low.z) - 1};
  const VoxelBox around{first, {first.x + 4, first.y + 4, first.z + 4}};
  const bool inside = around.clipped(grid_.box()) == around;
  const auto row_at = [&](int y, int z) {
    Densities row{};
    if (inside) {
      std::memcpy(&row, &density_[grid_.index(first.x, first.y + y, first.z + z)], sizeof(row));
    } else {
      for (int x = 0; x < 4; ++x) {
        const VoxelIndex v{first.x + x, first.y + y, first.z + z};
        if (grid_.contains(v)) row[x] = density_[grid_.index(v.x, v.y, v.z)];
      }
    }
    return __builtin_convertvector(row, Row);
  };
  // The weights of four voxels on an axis in the sum of the cube's two sides, and in their
  // difference.
  struct Weights {
    std::array<float, 4> sum, rise;
  };
  const auto weights = [&](int axis) {
    const float s = voxel[axis] - low[axis];
    return Weights{{1.0F - s, s, 1.0F - s, s}, {s - 1.0F, -s, 1.0F - s, s}};
  };
  const Weights by_x = weights(0), by_y = weights(1), by_z = weights(2);
  Row sums{}, rises_y{}, rises_z{};
  for (std::size_t z = 0; z < 4; ++z) {
    Row layer{}, layer_rise{};
    for (std::size_t y = 0; y < 4; ++y) {
      const Row row = row_at(static_cast<int>(y), static_cast<int>(z));
      layer += by_y.sum[y] * row;
      layer_rise += by_y.rise[y] * row;
    }
    sums += by_z.sum[z] * layer;
    rises_y += by_z.sum[z] * layer_rise;
    rises_z += by_z.rise[z] * layer;
  }
  glm::vec3 gradient(0.0F);
  for (int x = 0; x < 4; ++x) {
    const auto i = static_cast<std::size_t>(x);
    gradient +=
        glm::vec3(by_x.rise[i] * sums[x], by_x.sum[i] * rises_y[x], by_x.sum[i] * rises_z[x]);
  }
  return gradient / static_cast<float>(kDensityMax);
}

}  // namespace kerf
