// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "shared/volume/voxel_grid.hpp"
#include "visualizer/view/gradient.hpp"
#include "visualizer/view/pixel_rect.hpp"

namespace kerf {

/// What one kind of frame costs.
struct PictureRow {
  std::string renderer;
  Gradient gradient = Gradient::corners;
  VoxelGrid volume;          ///< as the paper names it, before any crop
  int tool = 0;              ///< voxels across: a ball is cut before each frame; 0: none
  bool cropped = false;      ///< only the tooth's box
  bool partial = false;      ///< only what the cut can change is drawn again; else all
  double cpu_ms = 0.0;       ///< median, over all threads
  double wall_ms_p50 = 0.0;  ///< of updating the renderer and drawing
  double wall_ms_p99 = 0.0;
  [[nodiscard]] double fps() const { return 1e3 / wall_ms_p50; }
};

/// Times the volumes of every renderer (no tool, no panel) in a picture of `size`, camera at rest:
/// the paper's volumes and tools, padded and cropped; and `iso` with every gradient. Needs a
/// current GL context. `progress` is told what comes next, and how many of how many kinds of frame
/// are done.
[[nodiscard]] std::vector<PictureRow> measure_pictures(
    PictureSize size,
    const std::function<void(const std::string& next, int done, int all)>& progress);

}  // namespace kerf
