// SPDX-License-Identifier: Apache-2.0
#include "visualizer/bench/normal_errors.hpp"

#include <numbers>
#include <random>

#include <glm/gtc/matrix_transform.hpp>

#include "visualizer/render/iso_renderer.hpp"

namespace kerf {

namespace {

constexpr int kSide = 64;
constexpr double kRadius = 28.0;
constexpr double kNoise = 0.015;        // of full density; standard deviation
constexpr double kLeastFacing = 0.342;  // sine of 20 degrees
constexpr PictureSize kSize{256, 256};

/// Voxels of 1 mm with the ball in their middle.
std::vector<Density> ball(double noise) {
  std::mt19937 random(1);
  std::vector<Density> density;
  for (int i = 0; i < kSide * kSide * kSide; ++i) {
    const glm::dvec3 at(i % kSide, i / kSide % kSide, i / kSide / kSide);
    const double distance = glm::length(at - 0.5 * (kSide - 1)) - kRadius;
    // A sum of twelve has the variance 1 and, unlike the library's, the same bits everywhere.
    double normal = 0.0;
    for (int k = 0; k < 12 && noise > 0.0; ++k) {
      normal += static_cast<double>(random()) * 0x1p-32 - 0.5;
    }
    const double share = std::clamp(0.5 - 0.5 * distance, 0.0, 1.0) + noise * normal;
    density.push_back(static_cast<Density>(std::lround(std::clamp(share, 0.0, 1.0) * kDensityMax)));
  }
  return density;
}

double angle_deg(Gradient gradient, const std::vector<Density>& density) {
  SceneView scene;
  scene.gradient = gradient;
  VolumeView& volume = scene.volumes.emplace_back();
  volume.bricks = BrickGrid::of({kSide, kSide, kSide});
  volume.world_from_voxel = glm::translate(glm::dmat4(1.0), glm::dvec3(-0.5 * (kSide - 1)));
  const VolumeContent content{density, {}};
  IsoRenderer renderer(scene, {&content, 1}, {.light = "normals.frag"});
  OrbitCamera camera;
  camera.frame(scene.corners(), 1.0);
  const View view = camera.view(1.0, 2.0 * kSide);
  const RenderTarget target(kSize);
  target.bind();
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  renderer.draw(view, target);
  const std::vector<std::uint8_t> rgb = target.read_rgb();

  const glm::dvec3 centre(view.eye_from_world * glm::dvec4(0.0, 0.0, 0.0, 1.0));
  double sum = 0.0;
  int pixels = 0;
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      const glm::dvec2 ndc((2.0 * x + 1.0) / kSize.width - 1.0,
                           1.0 - (2.0 * y + 1.0) / kSize.height);
      const glm::dvec3 ray = glm::normalize(glm::dvec3(ndc * view.tan_half_height, -1.0));
      const double middle = glm::dot(ray, centre);
      const double inside = kRadius * kRadius - glm::dot(centre, centre) + middle * middle;
      if (inside < 0.0) continue;
      const glm::dvec3 normal = ((middle - std::sqrt(inside)) * ray - centre) / kRadius;
      if (-glm::dot(normal, ray) < kLeastFacing) continue;
      const glm::dvec3 seen = shown_normal(&rgb[3 * static_cast<std::size_t>(y * kSize.width + x)]);
      const double angle = 2.0 * std::asin(0.5 * std::min(glm::length(seen - normal), 2.0));
      sum += angle * angle;
      ++pixels;
    }
  }
  return std::sqrt(sum / pixels) * 180.0 / std::numbers::pi;
}

}  // namespace

std::vector<GradientRow> measure_gradients() {
  const std::vector<Density> clean = ball(0.0), noisy = ball(kNoise);
  std::vector<GradientRow> rows;
  for (std::size_t i = 0; i < kGradientNames.size(); ++i) {
    const auto gradient = static_cast<Gradient>(i);
    rows.push_back({gradient, angle_deg(gradient, clean), angle_deg(gradient, noisy)});
  }
  return rows;
}

}  // namespace kerf
