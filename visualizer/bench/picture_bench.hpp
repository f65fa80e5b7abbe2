// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "shared/volume/voxel_grid.hpp"
#include "visualizer/scene/gradient_plan.hpp"
#include "visualizer/scene/pixel_rect.hpp"

namespace kerf {

/// The normal in eye space that a pixel drawn with normals.frag holds, to 1/4096.
[[nodiscard]] inline glm::dvec3 shown_normal(const std::uint8_t* rgb) {
  const int bits = rgb[0] << 16 | rgb[1] << 8 | rgb[2];
  const glm::dvec2 n = 2.0 * glm::dvec2(bits >> 12, bits & 0xfff) / 4095.0 - 1.0;
  return {n, std::sqrt(std::max(0.0, 1.0 - glm::dot(n, n)))};
}

/// What one way to take the gradient does to the normals of `iso`.
struct GradientRow {
  GradientFilter gradient;
  double angle_deg = 0.0;         ///< root mean square, on a ball
  double noisy_angle_deg = 0.0;   ///< `angle_deg` with noise in the density
  double p99_deg = 0.0;           ///< of 99 of 100 pixels of the ball
  double milled_angle_deg = 0.0;  ///< both in a hollow that a ball milled
  double milled_p99_deg = 0.0;
  double thick_2_p99_deg = 0.0;  ///< on a ball in voxels of 1 x 1 x 2, of 1 x 1 x 5, of 1 x 1 x 10
  double thick_5_p99_deg = 0.0;
  double thick_10_p99_deg = 0.0;
};

/// Measures each on an analytic ball of 28 voxels radius whose border is antialiased over two, as
/// tools and teeth are, in the shader's own normals; without noise, and with the 1.5 % of full
/// density that a CT of dentin has; in a hollow as a ball leaves it that stays;
/// and on a ball in thick voxels. Pixels seen at
/// less than 20 degrees, and the rim of the hollow, do not count. Needs a current GL context.
[[nodiscard]] std::vector<GradientRow> measure_gradients();

/// What one kind of frame costs.
struct PictureRow {
  std::string renderer;
  GradientFilter gradient = kDefaultGradient;
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
/// current GL context. `progress` receives what comes next, and how many of how many kinds of frame
/// are done.
[[nodiscard]] std::vector<PictureRow> measure_pictures(
    PictureSize size,
    const std::function<void(const std::string& next, int done, int all)>& progress);

/// What a run of the bench measured, and the machine.
struct PictureFigures {
  std::vector<PictureRow> rows;
  std::vector<GradientRow> gradients;
  std::string gl_renderer;
  PictureSize size;
  std::size_t cores = 0;
};
/// The figures as JSON (lab/report/pictures.py reads it).
[[nodiscard]] std::string picture_report(const PictureFigures& figures);

}  // namespace kerf
