// SPDX-License-Identifier: Apache-2.0
#include "visualizer/surface/vertex_look.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace kerf {

namespace {

constexpr float kNormalLength = 32767.0F;

/// To the nearest; for |value| < 2^15.
int rounded(float value) {
  return static_cast<int>(value + 32768.5F) - 32768;
}

std::uint16_t unit16(float share) {
  return static_cast<std::uint16_t>(std::clamp(share, 0.0F, 1.0F) * 65535.0F + 0.5F);
}

/// `Gradient::farid5` up to a factor: it looks farther than a neighbourhood.
glm::vec3 wide_gradient(const VolumeSamples& volume, VoxelIndex at) {
  constexpr GradientTaps kTaps = gradient_taps(Gradient::farid5);
  constexpr int kReach = gradient_reach(Gradient::farid5);
  glm::vec3 sum(0.0F);
  for (int z = 0; z <= 2 * kReach; ++z) {
    for (int y = 0; y <= 2 * kReach; ++y) {
      float slope = 0.0F, smooth = 0.0F;
      for (int x = 0; x <= 2 * kReach; ++x) {
        const auto i = static_cast<std::size_t>(x);
        const float density =
            volume.density_at(VoxelIndex{at.x + x - kReach, at.y + y - kReach, at.z + z - kReach});
        slope += kTaps.slope[i] * density;
        smooth += kTaps.smooth[i] * density;
      }
      const auto j = static_cast<std::size_t>(y), k = static_cast<std::size_t>(z);
      sum += glm::vec3(kTaps.smooth[j] * kTaps.smooth[k] * slope,
                       kTaps.slope[j] * kTaps.smooth[k] * smooth,
                       kTaps.smooth[j] * kTaps.slope[k] * smooth);
    }
  }
  return sum;
}

/// From what the vertex holds, not from what it was made of: to do it again gives the same bits.
FinePoint inward_of(const SurfaceVertex& vertex, const glm::vec3& inverse_square_spacing) {
  glm::vec3 along(vertex.normal[0], vertex.normal[1], vertex.normal[2]);
  float length = kNormalLength;
  if (inverse_square_spacing != glm::vec3(1.0F)) {
    along *= inverse_square_spacing;
    length = std::sqrt(glm::dot(along, along));
  }
  const glm::vec3 step = along * (-float{kFinePerVoxel} / length);
  return {rounded(step.x), rounded(step.y), rounded(step.z)};
}

/// Of a voxel `at`, whose density is `sample` of a neighbourhood; up to a factor.
glm::vec3 gradient_of(const SurfaceSource& source, const Density* sample, VoxelIndex at) {
  switch (source.gradient) {
    case Gradient::corners:
      return Neighbourhood::corner_gradient(sample);
    case Gradient::central:
      return Neighbourhood::central_gradient(sample);
    case Gradient::farid5:
      break;
  }
  return wide_gradient(source.volume, at);
}

}  // namespace

void dress(SurfaceVertex& vertex, const SurfaceSource& source, VoxelIndex start,
           const Neighbourhood& near) {
  std::array<int, 3> from{};
  std::size_t axis = 0;  // along which its cube edge runs
  int along = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    from[i] = vertex.position[i] >> kFineLog2;
    const int rest = vertex.position[i] & (kFinePerVoxel - 1);
    if (rest != 0) {
      axis = i;
      along = rest;
    }
  }
  const Density* low = near.at(from[0], from[1], from[2]);
  const Density* high = low + Neighbourhood::kStride[axis];
  VoxelIndex end{start.x + from[0], start.y + from[1], start.z + from[2]};
  const glm::vec3 low_slope = gradient_of(source, low, end);
  (axis == 0 ? end.x : axis == 1 ? end.y : end.z) += 1;
  const glm::vec3 high_slope = gradient_of(source, high, end);
  const glm::vec3 slope =
      glm::mix(low_slope, high_slope, static_cast<float>(along) / float{kFinePerVoxel});
  const float length = std::sqrt(glm::dot(slope, slope));
  glm::vec3 outward(0.0F);
  if (length > 0.0F) {
    outward = slope * (-1.0F / length);
  } else {  // a lone voxel looks the same on all sides
    outward[static_cast<int>(axis)] = *high > *low ? -1.0F : 1.0F;
  }
  for (int i = 0; i < 3; ++i) {
    vertex.normal[static_cast<std::size_t>(i)] =
        static_cast<std::int16_t>(rounded(outward[i] * kNormalLength));
  }
  const FinePoint at = fine_place(vertex, start);
  const FinePoint inward = inward_of(vertex, source.inverse_square_spacing);
  const glm::vec3 colour = source.look->colour(source.volume, at, inward);
  vertex.colour = {unit16(colour.r), unit16(colour.g), unit16(colour.b)};
  vertex.openness = unit16(source.look->openness(source.volume, at, inward));
}

DirtyMeshCells update_look(const SurfaceSource& source, VoxelIndex block, const VoxelBox& changed,
                           BlockMesh& mesh) {
  const VoxelIndex start = block_start(block);
  const VoxelBox colours = changed.grown(SurfaceLook::kColourReachVox);
  const VoxelBox all = changed.grown(SurfaceLook::kOpennessReachVox);
  std::optional<Neighbourhood> near;
  DirtyMeshCells cells;
  for (SurfaceVertex& vertex : mesh.vertices) {
    const SurfaceVertex before = vertex;
    const FinePoint at = fine_place(vertex, start);
    const VoxelIndex voxel = VolumeSamples::voxel_below(at);
    if (!all.contains(voxel)) continue;
    if (colours.contains(voxel)) {
      if (!near) near.emplace(source.volume, start);
      dress(vertex, source, start, *near);
    } else {
      const FinePoint inward = inward_of(vertex, source.inverse_square_spacing);
      if (!SurfaceLook::openness_depends_on(changed, at, inward)) continue;
      vertex.openness = unit16(source.look->openness(source.volume, at, inward));
    }
    if (vertex != before) cells.add(vertex);
  }
  return cells;
}

}  // namespace kerf
