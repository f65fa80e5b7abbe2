// SPDX-License-Identifier: Apache-2.0
#include "visualizer/bench/bench_tooth.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <glm/gtc/matrix_transform.hpp>

#include "shared/volume/voxel_grid.hpp"

namespace kerf {

namespace {

constexpr double kHeightMm = 22.4;
// Densities, 0 to 1.
constexpr double kEnamel = 0.9, kDentin = 0.6, kIso = 0.3;
// Lengths as fractions of the height; root tips at z = 0, width along x.
constexpr double kEnamelThickness = 0.045, kEnamelFrom = 0.55;
constexpr double kSmoothing = 0.05;

struct Ellipsoid {
  glm::dvec3 centre;
  glm::dvec3 radii;
};

constexpr auto kParts = std::to_array<Ellipsoid>({
    {{0.0, 0.0, 0.70}, {0.272, 0.235, 0.22}},     // crown
    {{-0.13, -0.11, 0.89}, {0.10, 0.10, 0.105}},  // cusps
    {{0.13, -0.11, 0.89}, {0.10, 0.10, 0.105}},
    {{-0.13, 0.11, 0.88}, {0.10, 0.10, 0.105}},
    {{0.13, 0.11, 0.88}, {0.10, 0.10, 0.105}},
    {{-0.12, 0.0, 0.32}, {0.09, 0.13, 0.315}},  // roots
    {{0.12, 0.0, 0.32}, {0.09, 0.13, 0.315}},
});

/// First-order distance |f| / |grad f|: exact on the surface.
double distance_to(const Ellipsoid& part, glm::dvec3 at) {
  const glm::dvec3 p = (at - part.centre) / part.radii;
  const double f = glm::length(p);
  const double slope = glm::length(p / part.radii);
  constexpr double kMiddle = 1e-9;
  return slope < kMiddle ? -1.0 : f * (f - 1.0) / slope;
}

/// Blends the two if they are within `kSmoothing` of one another.
double smooth_min(double a, double b) {
  const double near = std::max(kSmoothing - std::abs(a - b), 0.0);
  return std::min(a, b) - near * near / (4.0 * kSmoothing);
}

/// Negative inside.
double distance_to_tooth(glm::dvec3 at) {
  double distance = distance_to(kParts.front(), at);
  for (std::size_t i = 1; i < kParts.size(); ++i) {
    distance = smooth_min(distance, distance_to(kParts[i], at));
  }
  return distance;
}

/// 0..1; falls to 0 over two voxels, which are `edge` long.
double density_at(glm::dvec3 at, double edge) {
  constexpr double kFarOut = 0.4;  // there is only air
  if (std::max(std::abs(at.x), std::abs(at.y)) > kFarOut) return 0.0;
  const double distance = distance_to_tooth(at);
  const bool enamel = distance > -kEnamelThickness && at.z > kEnamelFrom;
  return (enamel ? kEnamel : kDentin) * std::clamp(0.5 - distance / (2.0 * edge), 0.0, 1.0);
}

/// The box of what is not air, with one voxel around.
VoxelBox body_of(const VoxelGrid& grid, const std::vector<Density>& density) {
  VoxelBox body;
  for_each_voxel(grid.box(), [&](int x, int y, int z) {
    if (density[grid.index(x, y, z)] == 0) return;
    body = body.with({x, y, z});
  });
  return body.grown(1).clipped(grid.box());
}

std::vector<Density> crop(const VoxelGrid& grid, const std::vector<Density>& density,
                          const VoxelBox& box) {
  std::vector<Density> cropped;
  for_each_voxel(box,
                 [&](int x, int y, int z) { cropped.push_back(density[grid.index(x, y, z)]); });
  return cropped;
}

}  // namespace

BenchTooth::BenchTooth(const VoxelGrid& padded, bool cropped) {
  const VoxelGrid& grid = padded;
  const double edge = 1.0 / grid.nz;
  const glm::dvec3 middle = 0.5 * glm::dvec3(grid.nx - 1, grid.ny - 1, 0);
  density_.reserve(grid.voxel_count());
  for_each_voxel(grid.box(), [&](int x, int y, int z) {
    const double fraction = density_at((glm::dvec3(x, y, z) - middle) * edge, edge);
    density_.push_back(static_cast<Density>(std::lround(fraction * kDensityMax)));
  });
  // The crown is up in the world, and the side of low y faces the camera.
  const double edge_mm = edge * kHeightMm;
  VolumeView whole;
  whole.name = "tooth";
  whole.bricks = BrickGrid::of(grid);
  whole.world_from_voxel =
      glm::dmat4(glm::dmat3({edge_mm, 0, 0}, {0, 0, -edge_mm}, {0, edge_mm, 0}));
  whole.iso = static_cast<Density>(kIso * kDensityMax);
  const VoxelBox body = body_of(grid, density_);
  const VoxelIndex extent = body.extent();
  VolumeView tight = whole;
  tight.bricks = BrickGrid::of({extent.x, extent.y, extent.z});
  tight.world_from_voxel =
      glm::translate(whole.world_from_voxel, glm::dvec3(body.lo.x, body.lo.y, body.lo.z));
  looked_at_ = tight.corners();
  if (cropped) density_ = crop(grid, density_, body);
  scene_.volumes = {cropped ? tight : whole};
  scene_.materials = {{"none", 0.0, {0, 0, 0}},
                      {"dentin", kIso, {0.80, 0.62, 0.33}},
                      {"enamel", 0.5 * (kDentin + kEnamel), {0.93, 0.91, 0.85}}};
}

ChangedBricks BenchTooth::cut(int diameter) {
  const BrickGrid& bricks = view().bricks;
  const VoxelIndex centre = next_centre();
  const VoxelBox box = VoxelBox{}.with(centre).grown(diameter / 2).clipped(bricks.grid.box());
  ChangedBricks cut;
  for_each_voxel(bricks.bricks_of(box), [&](int x, int y, int z) {
    cut.add(take_ball(bricks.id({x, y, z}), centre, 0.5 * diameter));
  });
  return cut;
}

/// Within a brick.
ChangedBrick BenchTooth::take_ball(std::uint32_t brick, VoxelIndex centre, double radius) {
  ChangedBrick changed{brick};
  const VoxelBox box = view().bricks.voxels(brick);
  for_each_voxel(box, [&](int x, int y, int z) {
    const glm::dvec3 off(x - centre.x, y - centre.y, z - centre.z);
    Density& at = density_[view().bricks.grid.index(x, y, z)];
    if (glm::length(off) > radius || at == 0) return;
    at = 0;
    changed.voxels[static_cast<std::size_t>(z - box.lo.z)] |=
        std::uint64_t{1} << (kBrickEdge * (y - box.lo.y) + x - box.lo.x);
  });
  return changed;
}

/// To and fro across the crown, a row lower each time; from there in to what is left of the tooth.
VoxelIndex BenchTooth::next_centre() {
  constexpr int kCutsAcross = 12, kRows = 6;
  constexpr int kStride = 5;  // not beside the last cut, which would be deepened
  constexpr double kWidth = 0.36, kTop = 0.82, kRowStep = 0.045;
  const VoxelGrid& grid = view().bricks.grid;
  const int row = cuts_ % kRows;
  const int across = kStride * cuts_ % kCutsAcross;
  ++cuts_;
  const double x = kWidth * ((across + 0.5) / kCutsAcross - 0.5);
  VoxelIndex centre{grid.nx / 2 + static_cast<int>(std::lround(x * grid.nz)), 0,
                    static_cast<int>(std::lround((kTop - kRowStep * row) * grid.nz))};
  while (centre.y < grid.ny - 1 &&
         density_[grid.index(centre.x, centre.y, centre.z)] < view().iso) {
    ++centre.y;
  }
  return centre;
}

}  // namespace kerf
