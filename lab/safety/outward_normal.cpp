// SPDX-License-Identifier: Apache-2.0
#include "lab/safety/outward_normal.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "shared/numeric/linear_algebra.hpp"

namespace kerf::faults {

using vec3::operator+;
using vec3::operator-;
using vec3::operator*;

OutwardNormal::OutwardNormal(const LoadedScene& scene) : scene_(scene) {
  if (scene.force.model == ForceModel::external) return;  // nothing of a solid is felt
  const SceneTool& tool = scene.tools[scene.active_tool];
  if (scene.volumes.size() != 1 || tool.shape != "ball" || scene.cut.model != CutModel::none) {
    return;
  }
  volume_ = &scene.volumes.front();
  axes_ = rotation_of(volume_->pose.orientation);
  const auto& spacing = volume_->image.spacing_mm;
  radius_mm_ = tool.radius_mm + std::max({spacing[0], spacing[1], spacing[2]});
}

OutwardNormal::Covered OutwardNormal::covered(DeviceVec<double> tip_mm) const {
  Covered covered;
  if (volume_ == nullptr) return covered;
  const auto& device = scene_.device;
  const vec3::Vec world = device.workspace_scale * vec3::Vec{tip_mm.x, tip_mm.y, tip_mm.z} +
                          device.offset_mm - volume_->pose.position_mm;
  const auto& grid = volume_->image.grid;
  const auto& spacing = volume_->image.spacing_mm;
  const std::array<std::int32_t, 3> extent{grid.nx, grid.ny, grid.nz};
  vec3::Vec middle{};  // of the ball, mm along the volume's axes
  std::array<std::int32_t, 3> lo{}, hi{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) middle[i] += axes_[3 * j + i] * world[j];
    const double end = extent[i];
    lo[i] = static_cast<std::int32_t>(
        std::clamp(std::ceil((middle[i] - radius_mm_) / spacing[i]), 0.0, end));
    hi[i] = static_cast<std::int32_t>(
        std::clamp(std::floor((middle[i] + radius_mm_) / spacing[i]) + 1, 0.0, end));
  }
  const double radius_mm2 = radius_mm_ * radius_mm_;
  const auto arm_of = [&](std::int32_t at, std::size_t axis) {
    return at * spacing[axis] - middle[axis];
  };
  for (std::int32_t z = lo[2]; z < hi[2]; ++z) {
    const double arm_z = arm_of(z, 2);
    for (std::int32_t y = lo[1]; y < hi[1]; ++y) {
      const double arm_y = arm_of(y, 1);
      if (arm_y * arm_y + arm_z * arm_z > radius_mm2) continue;  // the ball misses the row
      const Density* const row = &volume_->image.density[grid.index(0, y, z)];
      for (std::int32_t x = lo[0]; x < hi[0]; ++x) {
        if (row[x] < volume_->iso) continue;
        const vec3::Vec arm{arm_of(x, 0), arm_y, arm_z};
        if (vec3::dot(arm, arm) > radius_mm2) continue;
        covered.sum = covered.sum + arm;
        ++covered.voxels;
      }
    }
  }
  return covered;
}

std::optional<DeviceVec<double>> OutwardNormal::at(DeviceVec<double> tip_mm) const {
  const auto [sum, voxels] = covered(tip_mm);
  constexpr double kOwnMiddle = 0.1;  // of the radius: the way out is unknown
  if (voxels == 0 || vec3::length(sum) < kOwnMiddle * radius_mm_ * voxels) return std::nullopt;
  const vec3::Vec inward = vec3::unit(sum);
  DeviceVec<double> out;
  const auto along = [&](std::size_t row) {
    return -(axes_[3 * row] * inward[0] + axes_[3 * row + 1] * inward[1] +
             axes_[3 * row + 2] * inward[2]);
  };
  out = {along(0), along(1), along(2)};
  return out;
}

}  // namespace kerf::faults
