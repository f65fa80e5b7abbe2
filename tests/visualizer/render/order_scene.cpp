// SPDX-License-Identifier: Apache-2.0
#include "tests/visualizer/render/order_scene.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <glm/gtc/matrix_transform.hpp>

#include "visualizer/scene/appearance.hpp"

namespace kerf::test {

namespace {

// Two materials of one density, told apart by label; the third keeps green from being the hardest,
// which is the most translucent.
const std::vector<MaterialView> kMaterials{{"none", 0.0, {0, 0, 0}},
                                           {"red", 0.25, {0.8, 0.04, 0.04}},
                                           {"green", 0.25, {0.04, 0.8, 0.04}},
                                           {"hard", 0.9, {1, 1, 1}}};

struct Placed {
  Distance body;
  VoxelGrid grid;
  glm::dmat4 world_from_voxel;
  Label label;
};

Placed red_ball() {
  const glm::dvec3 centre{-1.2, 0.2, 0.3};
  const VoxelGrid grid{48, 40, 56};
  const glm::dmat4 turn = glm::rotate(glm::dmat4(1.0), 0.6, glm::dvec3(1, 2, 0.5));
  const glm::dmat4 voxels = centred(grid, {0.2, 0.24, 0.17});
  return {distance_to_ball(centre, 3.0), grid,
          glm::translate(glm::dmat4(1.0), centre) * turn * voxels, 1};
}

Placed green_torus() {
  constexpr double kRingMm = 2.6;
  constexpr double kTubeMm = 1.2;
  const VoxelGrid grid{60, 60, 28};
  const glm::dmat4 pose =
      glm::rotate(glm::translate(glm::dmat4(1.0), {1.6, -0.3, 0.2}), 0.9, glm::dvec3(0.3, 1, -0.4));
  const Distance torus = [body_from_world = glm::inverse(pose)](glm::dvec3 at) {
    const glm::dvec3 p(body_from_world * glm::dvec4(at, 1.0));
    return std::hypot(std::hypot(p.x, p.y) - kRingMm, p.z) - kTubeMm;
  };
  return {torus, grid, pose * centred(grid, glm::dvec3(TwoBodies::kShortestMm)), 2};
}

double share_at(double distance_mm) {
  return std::clamp(0.5 - distance_mm / TwoBodies::kRampMm, 0.0, 1.0);
}

}  // namespace

Distance distance_to_ball(glm::dvec3 centre_mm, double radius_mm) {
  return [=](glm::dvec3 at) { return glm::length(at - centre_mm) - radius_mm; };
}

std::optional<double> first_hit_mm(const PixelRay& ray, const Distance& body, double reach_mm,
                                   double far_mm) {
  constexpr double kArrivedMm = 1e-6;
  const double length_per_mm = glm::length(ray.direction);
  for (double at_mm = 0.0; at_mm < far_mm;) {
    const double left_mm = body(ray.origin_mm + at_mm * ray.direction) - reach_mm;
    if (left_mm < kArrivedMm) return at_mm;
    at_mm += left_mm / length_per_mm;
  }
  return std::nullopt;
}

TwoBodies::TwoBodies(bool swapped) {
  std::vector<Placed> placed{red_ball(), green_torus()};
  if (swapped) std::swap(placed[0], placed[1]);
  for (const Placed& one : placed) {
    bodies.push_back(one.body);
    volumes.emplace_back(one.grid, one.world_from_voxel,
                         [&](glm::dvec3 at) { return share_at(one.body(at)); });
    labels.emplace_back(one.grid.voxel_count(), one.label);
    scene.volumes.push_back(volumes.back().view);
  }
  scene.materials = kMaterials;
}

std::vector<VolumeContent> TwoBodies::contents() const {
  std::vector<VolumeContent> all;
  for (std::size_t v = 0; v < volumes.size(); ++v) all.push_back({volumes[v].density, labels[v]});
  return all;
}

std::unique_ptr<Renderer> TwoBodies::renderer_of(std::string_view kind, std::size_t v) const {
  SceneView alone = scene;
  alone.volumes = {scene.volumes[v]};
  return make_renderer(kind, alone, std::array{contents()[v]});
}

double TwoBodies::reach_mm(bool translucent) const {
  const TransferFunction look = make_transfer_function(scene.materials, volumes[0].view.iso, true);
  return translucent ? kRampMm * (0.5 - look.empty) : 0.0;
}

double TwoBodies::transparency(std::size_t v, const PixelRay& ray, double from_mm,
                               double to_mm) const {
  const TransferFunction look = make_transfer_function(scene.materials, volumes[v].view.iso, true);
  const double opacity = static_cast<double>(look.materials[1][labels[v].front()].a);
  constexpr double kStepMm = 0.02;
  double lengths = 0.0;
  for (double at_mm = from_mm; at_mm < to_mm; at_mm += kStepMm) {
    const double fraction = share_at(bodies[v](ray.origin_mm + at_mm * ray.direction));
    lengths += look.presence(fraction) * kStepMm * glm::length(ray.direction) / kOpacityMm;
  }
  return std::pow(1.0 - opacity, lengths);
}

std::vector<Nearest> nearest_bodies(const std::vector<Distance>& bodies,
                                    const std::vector<double>& reach_mm, const View& view,
                                    PictureSize size) {
  std::vector<Nearest> picture;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const PixelRay ray = pixel_ray(view, size, x, y);
      Nearest nearest{-1, view.far_mm, view.far_mm};
      for (std::size_t b = 0; b < bodies.size(); ++b) {
        const auto hit_mm = first_hit_mm(ray, bodies[b], reach_mm[b], view.far_mm);
        if (!hit_mm) continue;
        if (*hit_mm < nearest.mm) {
          nearest = {static_cast<int>(b), *hit_mm, nearest.mm};
        } else {
          nearest.next_mm = std::min(nearest.next_mm, *hit_mm);
        }
      }
      picture.push_back(nearest);
    }
  }
  return picture;
}

std::vector<bool> clear_pixels(const std::vector<Nearest>& picture, PictureSize size,
                               double margin_mm) {
  constexpr int kRim = 1;          // pixels
  constexpr double kEdgeMm = 0.8;  // a step in depth from one pixel to another
  std::vector<bool> clear(picture.size(), false);
  for (int y = kRim; y < size.height - kRim; ++y) {
    for (int x = kRim; x < size.width - kRim; ++x) {
      const auto at = static_cast<std::size_t>(y * size.width + x);
      const Nearest& here = picture[at];
      bool same = here.body < 0 || here.next_mm - here.mm > margin_mm;
      for (int dy = -kRim; dy <= kRim; ++dy) {
        for (int dx = -kRim; dx <= kRim; ++dx) {
          const Nearest& there = picture[static_cast<std::size_t>((y + dy) * size.width + x + dx)];
          same = same && there.body == here.body && std::abs(there.mm - here.mm) < kEdgeMm;
        }
      }
      clear[at] = same;
    }
  }
  return clear;
}

}  // namespace kerf::test
