// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "visualizer/cast/cast_kernels.hpp"
#include "visualizer/scene/appearance.hpp"
#include "visualizer/surface/volume_samples.hpp"

namespace kerf {

/// Material colour and ambient occlusion of points on a surface, computed once for each vertex: the
/// same that `iso` draws in each pixel (shaders/iso.frag). Light is added later, by the shader.
///
/// `inward` is the step of one voxel edge from the surface into the solid, along the normal;
/// `normal` points outwards, with the gradient's parts per voxel edge, of any length.
class VertexShading {
 public:
  /// Voxel edges, by axis, that samples along any normal reach (`kOcclusionTapsMm`).
  [[nodiscard]] static glm::dvec3 tap_reach_vox(const glm::dvec3& edges_mm);

  /// `edges_mm` of a voxel.
  VertexShading(const std::vector<MaterialView>& materials, Density iso,
                const glm::dvec3& edges_mm);

  /// Voxels around a change on which the ambient occlusion of a point can depend, by axis.
  [[nodiscard]] VoxelIndex ao_reach() const noexcept { return ao_reach_; }
  /// Linear colour of the material below the surface, each part 0..1.
  [[nodiscard]] glm::vec3 colour(const VolumeSamples& volume, FinePoint at, FinePoint inward) const;
  /// 1 in the open, less where the neighbourhood along the normal is solid.
  [[nodiscard]] float ao_factor(const VolumeSamples& volume, FinePoint at,
                                const glm::vec3& normal) const;
  /// Whether `ao_factor` there depends on a voxel in `box`.
  [[nodiscard]] bool ao_depends_on(const VoxelBox& box, FinePoint at,
                                   const glm::vec3& normal) const;

 private:
  /// A sample of ambient occlusion: where, from the surface, and its weight.
  struct Tap {
    FinePoint offset;
    float weight;
  };
  using Taps = std::array<Tap, kOcclusionTaps>;
  [[nodiscard]] Taps taps_along(const glm::vec3& normal) const;

  [[nodiscard]] glm::vec4 label_colour(const VolumeSamples& volume, FinePoint at) const;
  [[nodiscard]] glm::vec3 density_colour(int density) const;

  std::array<glm::vec4, kPaletteWidth> by_density_;
  std::array<glm::vec4, kPaletteWidth> by_label_;
  float share_of_iso_;  ///< 1/iso
  glm::vec3 edges_mm_;
  VoxelIndex ao_reach_;
};

}  // namespace kerf
