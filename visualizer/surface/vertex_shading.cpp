// SPDX-License-Identifier: Apache-2.0

#include "visualizer/surface/vertex_shading.hpp"

#include <algorithm>
#include <cmath>

namespace kerf {

namespace {

// The surface itself is half air, and a border is antialiased over two voxels.
constexpr int kDepthQuarters = 5;       // 1.25 voxels below the surface
constexpr int kFullDepthQuarters = 10;  // 2.5: past the border
// Soft tissue that lies on the surface, too thin for iso, coats it until it is milled away.
constexpr int kCoatDensity = static_cast<int>(0.14 * kDensityMax);

constexpr FinePoint stepped(FinePoint at, FinePoint inward, int quarters) {
  return at + (inward * quarters >> 2);
}

}  // namespace

glm::dvec3 VertexShading::tap_reach_vox(const glm::dvec3& edges_mm) {
  const double longest_mm = std::max({edges_mm.x, edges_mm.y, edges_mm.z});
  const double reach_mm =
      std::max(double{kOcclusionTapsMm[kOcclusionTaps - 1]}, kClearVox * longest_mm);
  return glm::min(reach_mm / edges_mm, double{kMostTapVox});
}

VertexShading::VertexShading(const std::vector<MaterialView>& materials, Density iso,
                             const glm::dvec3& edges_mm)
    : share_of_iso_(1.0F / static_cast<float>(iso)), edges_mm_(edges_mm) {
  const glm::dvec3 reach = glm::ceil(tap_reach_vox(edges_mm)) + 1.0;  // a sample has two voxels
  ao_reach_ = {static_cast<std::int32_t>(reach.x), static_cast<std::int32_t>(reach.y),
               static_cast<std::int32_t>(reach.z)};
  const auto palette = make_palette(materials);
  by_density_ = palette[0];
  by_label_ = palette[1];
  for (glm::vec4& colour : by_label_) colour.a = 1.0F;
}

glm::vec4 VertexShading::label_colour(const VolumeSamples& volume, FinePoint at) const {
  const VoxelIndex v = VolumeSamples::voxel_below(at);
  std::array<Label, 8> label{};
  for (int c = 0; c < 8; ++c) {
    label[static_cast<std::size_t>(c)] =
        volume.label_at({v.x + (c & 1), v.y + (c >> 1 & 1), v.z + (c >> 2)});
  }
  if (std::all_of(label.begin(), label.end(), [&](Label one) { return one == label[0]; })) {
    return label[0] == 0 ? glm::vec4(0.0F) : by_label_[label[0]];
  }
  const glm::vec3 fraction = glm::vec3(at & (kFinePerVoxel - 1)) / float{kFinePerVoxel};
  glm::vec4 sum(0.0F);
  for (unsigned c = 0; c < 8; ++c) {
    if (label[c] == 0) continue;
    const float weight = ((c & 1) != 0 ? fraction.x : 1.0F - fraction.x) *
                         ((c & 2) != 0 ? fraction.y : 1.0F - fraction.y) *
                         ((c & 4) != 0 ? fraction.z : 1.0F - fraction.z);
    sum += weight * by_label_[label[c]];
  }
  return sum;
}

glm::vec3 VertexShading::density_colour(int density) const {
  const float at = static_cast<float>(density) * static_cast<float>(kPaletteWidth - 1) /
                   static_cast<float>(kDensityMax);
  const auto low = std::min(static_cast<std::size_t>(at), std::size_t{kPaletteWidth - 2});
  return glm::mix(by_density_[low], by_density_[low + 1], at - static_cast<float>(low));
}

glm::vec3 VertexShading::colour(const VolumeSamples& volume, FinePoint at, FinePoint inward) const {
  const FinePoint below = stepped(at, inward, kDepthQuarters);
  if (!volume.labels.empty()) {
    glm::vec4 labelled = label_colour(volume, below);
    const FinePoint above = stepped(at, inward, -kDepthQuarters);
    if (volume.density_at(above) > kCoatDensity) {
      const glm::vec4 coat = label_colour(volume, above);
      labelled = glm::mix(labelled, coat, coat.a);
    }
    if (labelled.a > 0.0F) return glm::vec3(labelled) / labelled.a;
  }
  return density_colour(std::max(volume.density_at(below),
                                 volume.density_at(stepped(at, inward, kFullDepthQuarters))));
}

VertexShading::Taps VertexShading::taps_along(const glm::vec3& normal) const {
  const glm::vec3 slope = normal / edges_mm_;  // per mm
  const float steepness = std::sqrt(glm::dot(slope, slope));
  // Of the plane that the normal stands on: a voxel's extent along it is the root of the sum of
  // (part of the unit normal * edge)^2.
  const float voxel_mm = std::sqrt(glm::dot(normal, normal)) / steepness;
  const glm::vec3 edges_per_mm = slope / (steepness * edges_mm_);
  const float most_mm = kMostTapVox / std::sqrt(glm::dot(edges_per_mm, edges_per_mm));
  const float clear_mm = kClearVox * voxel_mm;
  Taps taps;
  for (int i = 0; i < kOcclusionTaps; ++i) {
    const bool longest = i + 1 == kOcclusionTaps;
    const float length_mm = kOcclusionTapsMm[i];
    const float clear = longest ? 1.0F : std::clamp(3.0F * length_mm / clear_mm - 2.0F, 0.0F, 1.0F);
    const float mm = std::min(longest ? std::max(length_mm, clear_mm) : length_mm, most_mm);
    const glm::vec3 offset = glm::floor(mm * float{kFinePerVoxel} * edges_per_mm + 0.5F);
    taps[static_cast<std::size_t>(i)] = {FinePoint(offset), clear * kOcclusionWeights[i]};
  }
  return taps;
}

float VertexShading::ao_factor(const VolumeSamples& volume, FinePoint at,
                               const glm::vec3& normal) const {
  float open = 1.0F;
  for (const Tap& tap : taps_along(normal)) {
    const auto density = static_cast<float>(volume.density_at(at + tap.offset));
    open -= tap.weight * std::min(density * share_of_iso_, 1.0F);
  }
  return open;
}

bool VertexShading::ao_depends_on(const VoxelBox& box, FinePoint at,
                                  const glm::vec3& normal) const {
  const VoxelBox cells{{box.lo.x - 1, box.lo.y - 1, box.lo.z - 1}, box.hi};
  const Taps taps = taps_along(normal);
  return std::any_of(taps.begin(), taps.end(), [&](const Tap& tap) {
    return cells.contains(VolumeSamples::voxel_below(at + tap.offset));
  });
}

}  // namespace kerf
