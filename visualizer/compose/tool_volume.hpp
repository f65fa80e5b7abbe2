// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <limits>
#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "shared/volume/changed_bricks.hpp"
#include "visualizer/compose/tool_painter.hpp"
#include "visualizer/scene/scene_view.hpp"

namespace kerf {

/// Positions of the points of a cubic grid.
struct GridPoints {
  VoxelGrid grid;
  glm::dvec3 first_mm;
  double edge_mm;
};

/// Signed distance of every point to the surface of a closed mesh, mm, negative inside; +-reach_mm
/// where it is more. Inside is where the mesh winds around a point. x fastest.
[[nodiscard]] std::vector<float> facet_distances(const Facets& facets, const GridPoints& points,
                                                 double reach_mm);

/// The tool in the hand of an arm as a volume of voxels: a volume of the scene like any other,
/// which moves.
///
/// The density falls over two voxels across the tool's surface and is one half on it. One grid has
/// room for every tool of the scene: another tool means other voxels. A voxel is as large as one of
/// the main volume, or larger if a tool would be longer than 512 voxels.
class ToolVolume {
 public:
  /// Of the second arm, the scene to which that of the first is added: each has a material. Throws
  /// VisualizerError if the scene has no tool with an extent, or no room for a material.
  explicit ToolVolume(const SceneView& scene);

  /// The scene with this volume as its last and with its material; the others keep their colours
  /// and opacities.
  [[nodiscard]] SceneView added_to(const SceneView& scene) const;
  [[nodiscard]] VolumeContent content() const { return {density_, labels_}; }

  /// Writes the voxels of tool `tool`; air if the scene has no such tool. Returns which changed.
  ChangedBricks take(std::uint32_t tool);
  [[nodiscard]] glm::dmat4 world_from_voxel(const Hand& hand) const;
  /// A box in the world around the voxels of the hand's tool; none if the tool has none.
  [[nodiscard]] std::optional<BoxCorners> corners(const Hand& hand) const;

 private:
  /// A box about the axis of the tool.
  struct Extent {
    double low_mm = std::numeric_limits<double>::max(), high_mm = -low_mm, radius_mm = 0.0;
    void add(double y_mm, double out_mm) {
      low_mm = std::min(low_mm, y_mm);
      high_mm = std::max(high_mm, y_mm);
      radius_mm = std::max(radius_mm, out_mm);
    }
  };
  /// What a tool is made of: what is swept about its axis, and a mesh.
  struct Parts {
    Outlines outlines;
    Facets facets;
  };
  void fill(const Parts& parts);

  std::vector<Parts> tools_;
  std::vector<Extent> extents_;  ///< by tool
  double edge_mm_ = 0.0;         ///< of a voxel
  glm::dvec3 first_mm_{0.0};     ///< its first voxel, from the tip
  VoxelGrid grid_;
  Label label_ = 0;
  std::optional<std::uint32_t> held_{};
  std::vector<Density> density_;
  std::vector<Label> labels_;
};

}  // namespace kerf
