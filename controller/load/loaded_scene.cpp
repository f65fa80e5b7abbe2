// SPDX-License-Identifier: Apache-2.0
#include "controller/load/loaded_scene.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "controller/input/load_error.hpp"

namespace kerf {
namespace {

double smallest(const Point3& spacing_mm) {
  return *std::min_element(spacing_mm.begin(), spacing_mm.end());
}

/// The density of one volume at points of the world.
class WorldDensity {
 public:
  explicit WorldDensity(const SceneVolume& volume)
      : image_(volume.image),
        rotation_(rotation_of(volume.pose.orientation)),
        position_mm_(volume.pose.position_mm) {}

  [[nodiscard]] Point3 world_of_voxel(const Point3& voxel) const {
    Point3 point{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      point[axis] = voxel[axis] * image_.spacing_mm[axis];
    point = rotated(rotation_, point);
    for (std::size_t axis = 0; axis < 3; ++axis) point[axis] += position_mm_[axis];
    return point;
  }

  /// Trilinear; 0 outside.
  [[nodiscard]] double at(const Point3& world_mm) const {
    const VoxelGrid& grid = image_.grid;
    const std::array<std::int32_t, 3> extent = {grid.nx, grid.ny, grid.nz};
    std::array<std::int32_t, 3> cell{};
    Point3 part{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double along_mm = 0;  // the inverse of a rotation is its transpose
      for (std::size_t i = 0; i < 3; ++i) {
        along_mm += rotation_[3 * i + axis] * (world_mm[i] - position_mm_[i]);
      }
      const double voxel = along_mm / image_.spacing_mm[axis];
      if (!(voxel > -1 && voxel < extent[axis])) return 0;
      cell[axis] = static_cast<std::int32_t>(std::floor(voxel));
      part[axis] = voxel - cell[axis];
    }
    double sum = 0;
    for (std::int32_t corner = 0; corner < 8; ++corner) {
      const VoxelIndex v{cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1),
                         cell[2] + (corner >> 2)};
      if (!grid.contains(v)) continue;
      const double weight = ((corner & 1) != 0 ? part[0] : 1 - part[0]) *
                            ((corner & 2) != 0 ? part[1] : 1 - part[1]) *
                            ((corner & 4) != 0 ? part[2] : 1 - part[2]);
      sum += weight * image_.density[grid.index(v.x, v.y, v.z)];
    }
    return sum;
  }

 private:
  const VolumeImage& image_;
  Matrix3 rotation_;
  Point3 position_mm_;
};

/// First point at or below `top` and not below `bottom_mm` where `density` reaches `iso`.
std::optional<Point3> descend(const WorldDensity& density, Point3 top, double bottom_mm,
                              double step_mm, double iso) {
  const double top_mm = top[1];
  const auto steps = static_cast<std::int64_t>(std::ceil((top_mm - bottom_mm) / step_mm));
  for (std::int64_t i = 0; i <= steps; ++i) {
    Point3 point = top;
    point[1] = std::max(bottom_mm, top_mm - static_cast<double>(i) * step_mm);
    if (density.at(point) < iso) continue;
    double inside_mm = point[1];
    double outside_mm = std::min(top_mm, inside_mm + step_mm);
    constexpr int kHalvings = 8;  // a quarter of an edge over 2^8: below a hundredth
    for (int halving = 0; halving < kHalvings; ++halving) {
      point[1] = (inside_mm + outside_mm) / 2;
      (density.at(point) < iso ? outside_mm : inside_mm) = point[1];
    }
    point[1] = inside_mm;
    return point;
  }
  return std::nullopt;
}

/// The centre of the solid voxel nearest to the vertical line through `middle`; of those at the
/// same distance the highest.
std::optional<Point3> nearest_solid_voxel(const SceneVolume& volume, const WorldDensity& density,
                                          const Point3& middle) {
  const VoxelGrid& grid = volume.image.grid;
  // Two distances that only differ by rounding are the same.
  const double same = 1e-6 * smallest(volume.image.spacing_mm);
  double least_mm = std::numeric_limits<double>::infinity();
  std::optional<Point3> best;
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = 0; y < grid.ny; ++y) {
      for (std::int32_t x = 0; x < grid.nx; ++x) {
        if (volume.image.density[grid.index(x, y, z)] < volume.iso) continue;
        const Point3 point = density.world_of_voxel(
            {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)});
        const double dx = point[0] - middle[0], dz = point[2] - middle[2];
        const double distance_mm = std::sqrt(dx * dx + dz * dz);
        const bool nearer = distance_mm < least_mm - same;
        const bool higher = best && distance_mm < least_mm + same && point[1] > (*best)[1];
        if (!nearer && !higher) continue;
        best = point;
        least_mm = std::min(least_mm, distance_mm);
      }
    }
  }
  return best;
}

}  // namespace

Pose place_volume(const VolumeImage& image, const Matrix3& orientation, const Point3& middle_mm) {
  Pose pose;
  pose.orientation = quaternion_of(product(orientation, image.direction));
  const std::array<std::int32_t, 3> extent = {image.grid.nx, image.grid.ny, image.grid.nz};
  Point3 to_middle{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    to_middle[axis] = image.spacing_mm[axis] * (extent[axis] - 1) / 2;
  }
  to_middle = rotated(rotation_of(pose.orientation), to_middle);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    pose.position_mm[axis] = middle_mm[axis] - to_middle[axis];
  }
  return pose;
}

WorldBox world_box(const SceneVolume& volume) {
  const VoxelGrid& grid = volume.image.grid;
  const Point3& spacing_mm = volume.image.spacing_mm;
  const Point3 half_mm = {spacing_mm[0] * grid.nx / 2, spacing_mm[1] * grid.ny / 2,
                          spacing_mm[2] * grid.nz / 2};
  const Point3 middle = WorldDensity(volume).world_of_voxel(
      {(grid.nx - 1) / 2.0, (grid.ny - 1) / 2.0, (grid.nz - 1) / 2.0});
  const Matrix3 rotation = rotation_of(volume.pose.orientation);
  WorldBox box{};
  for (std::size_t i = 0; i < 3; ++i) {
    double reach_mm = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      reach_mm += std::abs(rotation[3 * i + axis]) * half_mm[axis];
    }
    box.lo_mm[i] = middle[i] - reach_mm;
    box.hi_mm[i] = middle[i] + reach_mm;
  }
  return box;
}

Point3 first_surface_from_above(const SceneVolume& volume) {
  const WorldDensity density(volume);
  const WorldBox box = world_box(volume);
  constexpr double kMostSteps = 65536;  // whatever the spacing, and 16 times what any cube needs
  const double step_mm =
      std::max(smallest(volume.image.spacing_mm) / 4, (box.hi_mm[1] - box.lo_mm[1]) / kMostSteps);
  const Point3 top = {(box.lo_mm[0] + box.hi_mm[0]) / 2, box.hi_mm[1],
                      (box.lo_mm[2] + box.hi_mm[2]) / 2};
  if (const auto hit = descend(density, top, box.lo_mm[1], step_mm, volume.iso)) return *hit;
  const auto voxel = nearest_solid_voxel(volume, density, top);
  if (!voxel) {
    throw LoadError(volume.name +
                    ": no voxel reaches the iso density, there is no surface to "
                    "touch; lower iso or check the window");
  }
  const Point3 above = {(*voxel)[0], box.hi_mm[1], (*voxel)[2]};
  // The voxel itself is solid; rounding of the way back through the pose must not hide it.
  return descend(density, above, (*voxel)[1], step_mm, volume.iso * (1 - 1e-9)).value_or(*voxel);
}

LoadedScene second_arm_of(const LoadedScene& scene) {
  LoadedScene second;
  static_cast<SceneSettings&>(second) = scene;
  const SecondArm& arm = *scene.second;
  second.device = arm.device;
  second.limits = arm.limits;
  second.hand_script = arm.hand_script;
  second.hand_location = arm.hand_location;
  second.second.reset();
  second.tools = scene.tools;
  second.active_tool = scene.second_tool;
  second.identified = scene.second_identified;
  return second;
}

}  // namespace kerf
