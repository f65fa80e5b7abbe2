// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "visualizer/scene/appearance.hpp"
#include "visualizer/surface/volume_samples.hpp"

namespace kerf {

/// Material colour and ambient occlusion of points on a surface, computed once for each vertex: the
/// same that `iso` draws in each pixel (shaders/iso.frag). Light is added later, by the shader.
///
/// `inward` is the step of one voxel edge from the surface into the solid, along the normal.
class VertexShading {
 public:
  /// A voxel farther from a point than this has no influence on its ambient occlusion.
  static constexpr int kAoReachVox = 13;

  VertexShading(const std::vector<MaterialView>& materials, Density iso);

  /// Linear colour of the material below the surface, each part 0..1.
  [[nodiscard]] glm::vec3 colour(const VolumeSamples& volume, FinePoint at, FinePoint inward) const;
  /// 1 in the open, less where the neighbourhood along the normal is solid.
  [[nodiscard]] float ao_factor(const VolumeSamples& volume, FinePoint at, FinePoint inward) const;
  /// Whether `ao_factor` there depends on a voxel in `box`.
  [[nodiscard]] static bool ao_depends_on(const VoxelBox& box, FinePoint at, FinePoint inward);

 private:
  [[nodiscard]] glm::vec4 label_colour(const VolumeSamples& volume, FinePoint at) const;
  [[nodiscard]] glm::vec3 density_colour(int density) const;

  std::array<glm::vec4, kPaletteWidth> by_density_;
  std::array<glm::vec4, kPaletteWidth> by_label_;
  float share_of_iso_;  ///< 1/iso
};

}  // namespace kerf
