// SPDX-License-Identifier: Apache-2.0

#include "visualizer/scene/cross_sections.hpp"

#include <algorithm>
#include <cmath>

#include "visualizer/scene/appearance.hpp"

namespace kerf {

namespace {

constexpr std::array<std::uint8_t, 3> kAir{14, 16, 19};

/// Axes of the world that go to the right and down in a picture, with their signs, and the one
/// through it.
struct Section {
  int right, down, through;
  double right_sign, down_sign;
};
// World: x to the user's right, y up, z towards the user.
constexpr std::array<Section, 3> kSections{
    {{0, 2, 1, 1.0, 1.0}, {0, 1, 2, 1.0, -1.0}, {2, 1, 0, -1.0, -1.0}}};

/// Colours of one volume: materials as bright as they are dense.
class VolumeSampler {
 public:
  VolumeSampler(const VolumeView& volume, const VolumeContent& content, const Palette& palette)
      : grid_(volume.bricks.grid),
        voxel_from_world_(glm::inverse(volume.world_from_voxel)),
        content_(content),
        palette_(palette) {}

  [[nodiscard]] glm::dvec3 voxel_at(const glm::dvec3& world_mm) const {
    return {voxel_from_world_ * glm::dvec4(world_mm, 1.0)};
  }
  [[nodiscard]] glm::dvec3 voxels_along(const glm::dvec3& world_mm) const {
    return glm::dmat3(voxel_from_world_) * world_mm;
  }
  /// Density of the nearest voxel, and its colour; 0 outside.
  [[nodiscard]] Density at(const glm::dvec3& p, glm::vec3& colour) const {
    const glm::dvec3 nearest = glm::floor(p + 0.5);
    if (nearest.x < 0 || nearest.y < 0 || nearest.z < 0 || nearest.x >= grid_.nx ||
        nearest.y >= grid_.ny || nearest.z >= grid_.nz) {
      return 0;
    }
    const std::size_t i =
        grid_.index(static_cast<std::int32_t>(nearest.x), static_cast<std::int32_t>(nearest.y),
                    static_cast<std::int32_t>(nearest.z));
    const Density density = content_.density[i];
    const Label label = content_.labels.empty() ? Label{0} : content_.labels[i];
    colour = glm::vec3(label > 0 ? palette_[1][label] : palette_[0][density >> 8]);
    return density;
  }

 private:
  VoxelGrid grid_;
  glm::dmat4 voxel_from_world_;
  VolumeContent content_;
  const Palette& palette_;
};

/// By a table: a power for each pixel would take most of the time.
std::uint8_t eight_bits(double linear) {
  constexpr int kLast = 8191;
  static const std::vector<std::uint8_t> kTable = [] {
    constexpr double kGamma = 2.2;
    std::vector<std::uint8_t> made;
    for (int i = 0; i <= kLast; ++i) {
      const double value = std::pow(static_cast<double>(i) / kLast, 1.0 / kGamma);
      made.push_back(static_cast<std::uint8_t>(std::lround(255.0 * value)));
    }
    return made;
  }();
  return kTable[static_cast<std::size_t>(std::clamp(linear, 0.0, 1.0) * kLast + 0.5)];
}

}  // namespace

SliceViews slice_views(const SceneView& scene, std::span<const VolumeContent> contents,
                       const glm::dvec3& tip_mm, int side) {
  const Palette palette = make_palette(scene.materials);
  std::vector<VolumeSampler> volumes;
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    volumes.emplace_back(scene.volumes[v], contents[v], palette);
  }
  const std::vector<glm::dvec3> corners = scene.corners();
  glm::dvec3 low = corners.front(), high = low;
  for (const glm::dvec3& corner : corners) {
    low = glm::min(low, corner);
    high = glm::max(high, corner);
  }
  const glm::dvec3 extent = high - low, middle = 0.5 * (low + high);
  const double span_mm = std::max({extent.x, extent.y, extent.z});
  const double pixel_mm = span_mm / side;

  SliceViews views{.side = side};
  views.rgb.reserve(static_cast<std::size_t>(side) * static_cast<std::size_t>(side) * 9);
  for (std::size_t s = 0; s < kSections.size(); ++s) {
    const Section& section = kSections[s];
    glm::dvec3 right(0.0), down(0.0), corner = middle;
    right[section.right] = section.right_sign * pixel_mm;
    down[section.down] = section.down_sign * pixel_mm;
    corner[section.through] = tip_mm[section.through];
    corner -= 0.5 * side * (right + down);
    views.tip[s] = {0.5 + section.right_sign * (tip_mm - middle)[section.right] / span_mm,
                    0.5 + section.down_sign * (tip_mm - middle)[section.down] / span_mm};
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        Density densest = 0;
        glm::vec3 colour(0.0F);
        for (const VolumeSampler& volume : volumes) {
          glm::vec3 own(0.0F);
          const glm::dvec3 at =
              volume.voxel_at(corner) + volume.voxels_along((x + 0.5) * right + (y + 0.5) * down);
          const Density density = volume.at(at, own);
          if (density <= densest) continue;
          densest = density;
          colour = own;
        }
        const double bright = densest / kDensityMax;
        for (int i = 0; i < 3; ++i) {
          views.rgb.push_back(std::max(kAir[static_cast<std::size_t>(i)],
                                       eight_bits(static_cast<double>(colour[i]) * bright)));
        }
      }
    }
  }
  return views;
}

}  // namespace kerf
