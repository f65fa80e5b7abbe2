// SPDX-License-Identifier: Apache-2.0
// Parts of a volume that are as thin as a voxel, full or empty, against an exact march: within a
// cell of eight voxels the density along a ray is a cubic, whose first root is found in doubles.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <string>

#include <doctest/doctest.h>

#include "tests/visualizer/render/renderer_fixture.hpp"

namespace kerf::thin_parts_test {

using namespace kerf::test;

namespace {

constexpr PictureSize kThinSize{160, 160};
constexpr double kIso = 0.5;

/// Density 0..1 between voxels, air around the volume.
double density_at(const TestVolume& volume, const glm::dvec3& voxel) {
  const VoxelGrid& grid = volume.view.bricks.grid;
  const glm::dvec3 low = glm::floor(voxel);
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::ivec3 side(corner & 1, corner >> 1 & 1, corner >> 2);
    const glm::ivec3 v = glm::ivec3(low) + side;
    if (!grid.contains({v.x, v.y, v.z})) continue;
    const glm::dvec3 near = 1.0 - glm::abs(voxel - glm::dvec3(v));
    sum += near.x * near.y * near.z * volume.density[grid.index(v.x, v.y, v.z)];
  }
  return sum / kDensityMax;
}

/// Where `value` first is 0 or more between `from` and `to`, within which it is a cubic.
template <class Value>
std::optional<double> first_root(const Value& value, double from, double to) {
  const auto at = [&](double s) { return value(from + s * (to - from)); };
  // Newton's differences at 0, 1/3, 2/3, 1 give the cubic, and the roots of its slope.
  const double y0 = at(0.0), y1 = at(1.0 / 3), y2 = at(2.0 / 3), y3 = at(1.0);
  const double c1 = 0.5 * (-11 * y0 + 18 * y1 - 9 * y2 + 2 * y3);
  const double c2 = 4.5 * (2 * y0 - 5 * y1 + 4 * y2 - y3);
  const double c3 = 4.5 * (-y0 + 3 * y1 - 3 * y2 + y3);
  std::vector<double> ends{0.0};
  const double a = 3 * c3, b = 2 * c2, root = b * b - 4 * a * c1;
  if (std::abs(a) < 1e-12) {
    if (std::abs(b) > 1e-12) ends.push_back(-c1 / b);
  } else if (root > 0.0) {
    ends.push_back((-b - std::sqrt(root)) / (2 * a));
    ends.push_back((-b + std::sqrt(root)) / (2 * a));
  }
  std::erase_if(ends, [](double s) { return s < 0.0 || s > 1.0; });
  ends.push_back(1.0);
  std::sort(ends.begin(), ends.end());
  if (y0 >= 0.0) return from;
  for (std::size_t i = 1; i < ends.size(); ++i) {
    double low = ends[i - 1], high = ends[i];
    if (at(high) < 0.0) continue;
    for (int k = 0; k < 60; ++k) {
      const double middle = 0.5 * (low + high);
      (at(middle) < 0.0 ? low : high) = middle;
    }
    return from + high * (to - from);
  }
  return std::nullopt;
}

/// Where the ray first meets the iso-surface, along the view axis.
std::optional<double> exact_march_mm(const TestVolume& volume, const PixelRay& ray,
                                     const View& view) {
  const VoxelGrid& grid = volume.view.bricks.grid;
  const glm::dmat4 voxel_from_world = glm::inverse(volume.view.world_from_voxel);
  const glm::dvec3 origin(voxel_from_world * glm::dvec4(ray.origin_mm, 1.0));
  const glm::dvec3 direction = glm::dmat3(voxel_from_world) * ray.direction;
  const glm::ivec3 extent(grid.nx, grid.ny, grid.nz);
  std::vector<double> crossings{view.near_mm, view.far_mm};
  for (int axis = 0; axis < 3; ++axis) {
    for (int plane = -1; plane <= extent[axis]; ++plane) {
      const double t = (plane - origin[axis]) / direction[axis];
      if (t > view.near_mm && t < view.far_mm) crossings.push_back(t);
    }
  }
  std::sort(crossings.begin(), crossings.end());
  const auto value = [&](double t) { return density_at(volume, origin + t * direction) - kIso; };
  for (std::size_t i = 1; i < crossings.size(); ++i) {
    const double from = crossings[i - 1], to = crossings[i];
    const glm::dvec3 middle = origin + 0.5 * (from + to) * direction;
    if (glm::any(glm::lessThan(middle, glm::dvec3(-1.0))) ||
        glm::any(glm::greaterThan(middle, glm::dvec3(extent)))) {
      continue;
    }
    if (const auto root = first_root(value, from, to)) return root;
  }
  return std::nullopt;
}

/// A volume of full and empty voxels: `full(x, y, z)`.
template <class Full>
TestVolume binary(const VoxelGrid& grid, const glm::dvec3& edges_mm, const Full& full) {
  TestVolume volume(grid, centred(grid, edges_mm), [](glm::dvec3) { return 0.0; });
  for_each_voxel(grid.box(), [&](int x, int y, int z) {
    if (full(x, y, z)) volume.density[grid.index(x, y, z)] = 65535;
  });
  return volume;
}

struct Named {
  std::string name;
  TestVolume volume;
};

std::vector<Named> thin_parts() {
  std::vector<Named> all;
  const VoxelGrid grid{24, 20, 22};
  std::mt19937 random(3);
  const auto pick = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  const auto add = [&](const char* name, const std::vector<VoxelBox>& boxes,
                       const glm::dvec3& edges_mm) {
    all.push_back({name, binary(grid, edges_mm, [&](int x, int y, int z) {
                     return std::any_of(boxes.begin(), boxes.end(), [&](const VoxelBox& box) {
                       return box.contains({x, y, z});
                     });
                   })});
  };
  std::vector<VoxelBox> voxels, rods, plates;
  for (int i = 0; i < 24; ++i) {
    const VoxelIndex at{pick(24), pick(20), pick(22)};
    const VoxelBox one{at, {at.x + 1, at.y + 1, at.z + 1}};
    voxels.push_back(one);
    VoxelBox rod = one;
    if (i % 3 == 0) rod = {{2, at.y, at.z}, {21, at.y + 1, at.z + 1}};
    if (i % 3 == 1) rod = {{at.x, 1, at.z}, {at.x + 1, 18, at.z + 1}};
    if (i % 3 == 2) rod = {{at.x, at.y, 3}, {at.x + 1, at.y + 1, 22}};
    if (i < 12) rods.push_back(rod);
    const VoxelIndex far{at.x + 5, at.y + 6, at.z + 4};
    if (i % 3 == 0) rod = {at, {far.x, far.y, at.z + 1}};
    if (i % 3 == 1) rod = {at, {at.x + 1, far.y, far.z}};
    if (i % 3 == 2) rod = {at, {far.x, at.y + 1, far.z}};
    if (i < 9) plates.push_back(rod);
  }
  add("single voxels", voxels, glm::dvec3(0.4));
  add("rods", rods, glm::dvec3(0.4));
  add("plates", plates, glm::dvec3(0.4));
  add("rods of thick voxels", rods, {0.2, 0.3, 0.6});
  const auto diagonal = [](int x, int y, int z) { return x == y && y == z; };
  all.push_back({"diagonal", binary({20, 20, 20}, glm::dvec3(0.4), diagonal)});
  const auto one = [](int, int, int) { return true; };
  all.push_back({"one voxel", binary({1, 1, 1}, glm::dvec3(6.0), one)});
  const auto grating = [](int x, int, int z) { return (x + z) % 4 != 0; };
  all.push_back({"one voxel thick", binary({9, 1, 7}, glm::dvec3(0.9), grating)});
  return all;
}

/// Pixels that the march and a renderer show.
struct Shown {
  int exact = 0;    ///< by the march
  int missing = 0;  ///< by the march alone
  int extra = 0;    ///< by the renderer alone
  int off = 0;      ///< by both, a twentieth of a voxel or more apart
};

}  // namespace

TEST_CASE("iso and cast show parts as thin as a voxel as an exact march does") {
  if (!have_gl()) return;
  const RenderTarget target(kThinSize);
  const std::array<std::string, 2> kinds{"iso", "cast"};
  const std::array views{look_at({9, 14, 18}, {}, 8, 45), look_at({0.3, 0.2, 24}, {}, 8, 45),
                         look_at({-20, 3, -9}, {}, 8, 45), look_at({2, -23, 3}, {}, 8, 45)};
  for (const Named& part : thin_parts()) {
    const VolumeContent content = part.volume.content();
    const SceneView scene = scene_of({&part.volume});
    const auto iso = make_renderer(kinds[0], scene, {&content, 1});
    const auto cast = make_renderer(kinds[1], scene, {&content, 1});
    const double edge_mm = shortest_edge_mm(part.volume.view.world_from_voxel);
    std::array<Shown, 2> shown{};
    for (const View& view : views) {
      const std::array drawn{draw(*iso, view, target), draw(*cast, view, target)};
      for (int y = 0; y < kThinSize.height; ++y) {
        for (int x = 0; x < kThinSize.width; ++x) {
          const auto exact = exact_march_mm(part.volume, pixel_ray(view, kThinSize, x, y), view);
          const auto at = static_cast<std::size_t>(y * kThinSize.width + x);
          for (std::size_t i = 0; i < drawn.size(); ++i) {
            const float depth = drawn[i].depth[at];
            const bool there = depth < 1.0F;
            Shown& sum = shown[i];
            if (exact) ++sum.exact;
            if (exact && !there) ++sum.missing;
            if (!exact && there) ++sum.extra;
            if (!exact || !there) continue;
            const double off_mm = eye_distance_mm(static_cast<double>(depth), view) - *exact;
            if (std::abs(off_mm) > 0.05 * edge_mm) ++sum.off;
          }
        }
      }
    }
    for (std::size_t i = 0; i < shown.size(); ++i) {
      const auto& [exact, missing, extra, off] = shown[i];
      CAPTURE(part.name);
      CAPTURE(kinds[i]);
      CHECK(exact > 1000);
      CHECK(missing <= 0.005 * exact);
      CHECK(extra <= 0.005 * exact);
      CHECK(off <= 0.005 * exact);
    }
  }
}

}  // namespace kerf::thin_parts_test
