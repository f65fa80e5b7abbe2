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

using Reaches = float __attribute__((vector_size(16)));

// Outwards; iso.frag. Some stand twice, to fill the rows.
constexpr std::array<Reaches, 2> kFeelersVox{Reaches{-2.5F, -2.5F, -1.25F, 1.25F},
                                             Reaches{2.5F, 6.0F, 12.0F, 12.0F}};
constexpr float kInwardsVox = 2.5F;
constexpr float kLongestVox = 12.0F;
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

Feelers::Feelers(const VolumeView& volume, std::span<const Density> density,
                 std::span<const VoxelBox> differs, const View& view, PictureSize size)
    : grid_(volume.bricks.grid),
      density_(density),
      near_mm_(static_cast<float>(view.near_mm)),
      far_mm_(static_cast<float>(view.far_mm)) {
  const glm::dmat4 eye_from_voxel = view.eye_from_world * volume.world_from_voxel;
  const glm::dmat4 voxel_from_eye = glm::affineInverse(eye_from_voxel);
  voxel_from_eye_ = glm::mat3(voxel_from_eye);
  outward_from_gradient_ = -(voxel_from_eye_ * glm::transpose(voxel_from_eye_));
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

/// The inverse of equation (1), as in depth.frag.
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
  return t * glm::dot(along, along) + kInwardsVox * longest_edge_mm_ * glm::length(along);
}

/// How far along a ray, up to the same factor, the nearest of all ends may be.
float Feelers::nearest_end(const glm::vec3& along) const {
  float nearest = glm::dot(eye_centre_, along);
  for (const glm::vec3& half : eye_half_) nearest -= std::abs(glm::dot(half, along));
  return nearest;
}

bool Feelers::may_reach(int x, int y, float window_depth) {
  const glm::vec3 along = direction(x, y);
  const float t = eye_mm(window_depth);
  const glm::vec3 per_mm = voxel_from_eye_ * along;
  const glm::vec3 at = origin_ + t * per_mm;
  const glm::vec3 away = glm::max(glm::max(any_end_.lo - at, at - any_end_.hi), glm::vec3(0.0F));
  if (glm::dot(away, away) > kLongestVox * kLongestVox) return false;

  const glm::vec3 gradient = gradient_at(at);
  if (glm::dot(gradient, gradient) < kLeastSlope * kLeastSlope) return true;
  // As in iso.frag: by the transposed Jacobian to the eye's millimetres, turned, and back.
  glm::vec3 outward = outward_from_gradient_ * gradient;
  if (glm::dot(gradient, per_mm) < 0.0F) {  // it looks away from the eye
    const glm::vec3 normal = -glm::normalize(gradient * voxel_from_eye_);
    const glm::vec3 to_eye = -glm::normalize(along);
    outward = voxel_from_eye_ * (normal - 1.02F * glm::dot(normal, to_eye) * to_eye);
  }
  return ends_in_change(at, glm::normalize(outward));
}

bool Feelers::ends_in_change(const glm::vec3& at, const glm::vec3& outward) const {
  const auto misses = [&](const Box& box) {
    const auto beside = [&](const Row& reach) {
      auto is = Row{} > Row{};
      for (int axis = 0; axis < 3; ++axis) {
        const Row end = at[axis] + reach * outward[axis];
        is |= (end < box.lo[axis]) | (end > box.hi[axis]);
      }
      return is;
    };
    const auto all = beside(kFeelersVox[0]) & beside(kFeelersVox[1]);
    return (all[0] & all[1] & all[2] & all[3]) != 0;
  };
  return !misses(any_end_) && !std::all_of(ends_.begin(), ends_.end(), misses);
}

/// As `gradient_at` in iso.frag, in full densities: from the eight corners of a cube two voxels
/// wide. Densities between voxels are interpolated, and so are their gradients.
glm::vec3 Feelers::gradient_at(const glm::vec3& voxel) {
  const glm::vec3 low = glm::floor(voxel);
  const glm::vec3 share = voxel - low;
  const Cell& cell =
      cell_at({static_cast<int>(low.x), static_cast<int>(low.y), static_cast<int>(low.z)});
  const auto mixed = [&](const std::array<Row, 4>& of) {
    const Row front = of[0] + share.y * (of[1] - of[0]);
    const Row back = of[2] + share.y * (of[3] - of[2]);
    return front + share.z * (back - front);
  };
  const Row z_and_x = mixed(cell.z_and_x), y = mixed(cell.y);
  const glm::vec3 first(z_and_x[2], y[0], z_and_x[0]), second(z_and_x[3], y[1], z_and_x[1]);
  return (first + share.x * (second - first)) / static_cast<float>(kDensityMax);
}

const Feelers::Cell& Feelers::cell_at(VoxelIndex at) {
  // Cells beside one another have places of their own.
  Cell& cell = cells_[static_cast<std::size_t>((at.x & 7) + 8 * (at.y & 3) + 32 * (at.z & 3))];
  if (cell.made && cell.at == at) return cell;
  cell.made = true;
  cell.at = at;
  using Densities = Density __attribute__((vector_size(8)));
  const VoxelIndex first{at.x - 1, at.y - 1, at.z - 1};
  const VoxelBox around{first, {first.x + 4, first.y + 4, first.z + 4}};
  const bool inside = around.clipped(grid_.box()) == around;
  std::array<std::array<Row, 2>, 4> sums;   // by z and y: of the voxels before and behind in y
  std::array<std::array<Row, 2>, 4> rises;  // their difference
  for (int z = 0; z < 4; ++z) {
    std::array<Row, 4> rows;  // by y: lanes 0 and 1 are sums along x, 2 and 3 are differences
    for (int y = 0; y < 4; ++y) {
      Densities row{};
      if (inside) {
        std::memcpy(&row, &density_[grid_.index(first.x, first.y + y, first.z + z)], sizeof(row));
      } else {
        for (int x = 0; x < 4; ++x) {
          const VoxelIndex v{first.x + x, first.y + y, first.z + z};
          if (grid_.contains(v)) row[x] = density_[grid_.index(v.x, v.y, v.z)];
        }
      }
      const Row d = __builtin_convertvector(row, Row);
      rows[static_cast<std::size_t>(y)] =
          __builtin_shufflevector(d, d, 2, 3, 2, 3) +
          Row{1.0F, 1.0F, -1.0F, -1.0F} * __builtin_shufflevector(d, d, 0, 1, 0, 1);
    }
    const auto layer = static_cast<std::size_t>(z);
    sums[layer] = {rows[0] + rows[2], rows[1] + rows[3]};
    rises[layer] = {rows[2] - rows[0], rows[3] - rows[1]};
  }
  for (std::size_t corner = 0; corner < 4; ++corner) {
    const std::size_t y = corner & 1, z = corner >> 1;
    cell.z_and_x[corner] = __builtin_shufflevector(sums[z + 2][y] - sums[z][y],
                                                   sums[z + 2][y] + sums[z][y], 0, 1, 6, 7);
    cell.y[corner] = rises[z][y] + rises[z + 2][y];
  }
  return cell;
}

}  // namespace kerf
