// SPDX-License-Identifier: Apache-2.0
// A body looks the same whatever voxels it is stored in: pictures of one body in voxels of 0.1 mm,
// of 0.5 mm and of 5 : 1.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "tests/visualizer/render/renderer_fixture.hpp"

namespace kerf::voxel_size_test {

using namespace kerf::test;

namespace {

/// Whether a point is in the body.
using Inside = std::function<bool(glm::dvec3)>;

/// The body in voxels of these edges, each as full as the body fills it, by 6x6x6 points; air for
/// two voxels around `half_mm`.
TestVolume stored(const Inside& inside, const glm::dvec3& half_mm, const glm::dvec3& edges_mm) {
  constexpr int kPoints = 6;
  const auto count = [](double half, double edge) {
    return 2 * static_cast<int>(std::ceil(half / edge + 2.0)) + 1;
  };
  const VoxelGrid grid{count(half_mm.x, edges_mm.x), count(half_mm.y, edges_mm.y),
                       count(half_mm.z, edges_mm.z)};
  return {grid, centred(grid, edges_mm), [&](glm::dvec3 at) {
            int corners = 0;
            for (int c = 0; c < 8; ++c) {
              const glm::dvec3 side((c & 1) * 2 - 1, (c & 2) - 1, (c & 4) / 2 - 1);
              corners += inside(at + 0.5 * side * edges_mm) ? 1 : 0;
            }
            if (corners == 0 || corners == 8) return corners / 8.0;
            int filled = 0;
            for (int i = 0; i < kPoints * kPoints * kPoints; ++i) {
              const glm::dvec3 place(i % kPoints, i / kPoints % kPoints, i / kPoints / kPoints);
              filled += inside(at + ((place + 0.5) / double{kPoints} - 0.5) * edges_mm) ? 1 : 0;
            }
            return filled / double{kPoints * kPoints * kPoints};
          }};
}

// The finest last: the others are compared with it.
const std::array<glm::dvec3, 4> kEdgesMm{
    {{0.5, 0.5, 0.5}, {0.1, 0.1, 0.5}, {0.5, 0.1, 0.1}, {0.1, 0.1, 0.1}}};
constexpr int kMostLevels = 3;  // of 255

/// Whether a pixel whose ray meets the body at a point has to look the same.
using Compared = std::function<bool(const PixelRay& ray, const glm::dvec3& at_mm)>;

struct Body {
  const char* name;
  Inside inside;
  glm::dvec3 half_mm;
  View view;
  Compared compared;
};

constexpr double kRadiusMm = 4.8;
constexpr glm::dvec3 kCentreMm{0.013, -0.027, 0.041};  // on no voxel
/// A silhouette at 0.5 mm is blurred over one and a half voxels: compared is what lies 0.75 mm and
/// a pixel, 0.25 mm, within it. There the ball faces the eye by the root of 1 - (3.8 / 4.8)^2.
constexpr double kLeastFacing = 0.61;

Body ball_body() {
  return {"ball", [](glm::dvec3 at) { return glm::length(at - kCentreMm) < kRadiusMm; },
          glm::dvec3(kRadiusMm), look_at({7, 15, 19}, {}, 10, 40),
          [](const PixelRay& ray, const glm::dvec3& at) {
            return -glm::dot(glm::normalize(at - kCentreMm), glm::normalize(ray.direction)) >
                   kLeastFacing;
          }};
}

/// Two plates of 12x12x3 mm that face each other, seen from between them. Their edges are farther
/// from what is compared than the gradient's filter reaches: 7 voxels of 0.5 mm.
Body gap_body(const char* name, double gap_mm, const View& view) {
  const double half = 0.5 * gap_mm;
  return {name,
          [=](glm::dvec3 at) {
            const double x = std::abs(at.x);
            return x > half && x < half + 3.0 && std::abs(at.y) < 6.0 && std::abs(at.z) < 6.0;
          },
          {half + 3.0, 6.0, 6.0},
          view,
          [](const PixelRay&, const glm::dvec3& at) {
            return at.x < 0.0 && std::abs(at.y) < 2.5 && std::abs(at.z) < 2.5;
          }};
}

/// The narrower gap darkens its walls by the longest tap of ambient occlusion alone, the wider not
/// at all; in voxel edges, both did by what 0.5 mm make of them.
std::vector<Body> bodies() {
  return {ball_body(), gap_body("wide gap", 2.2, look_at({0.9, 0, 2.4}, {-1.1, 0, 0.2}, 0.2, 20)),
          gap_body("narrow gap", 1.0, look_at({0.35, 0, 1.6}, {-0.5, 0, 0.4}, 0.1, 20))};
}

/// The pixels of `body` that are compared, where both pictures show it.
std::vector<int> levels_apart(const Body& body, const Drawn& a, const Drawn& b) {
  std::vector<int> levels;
  for_each_pixel(body.view, [&](std::size_t at, const PixelRay& ray) {
    if (a.depth[at] >= 1.0F || b.depth[at] >= 1.0F) return;
    const double t = eye_distance_mm(static_cast<double>(b.depth[at]), body.view);
    if (!body.compared(ray, ray.origin_mm + t * ray.direction)) return;
    int most = 0;
    for (std::size_t i = 3 * at; i < 3 * at + 3; ++i) {
      most = std::max(most, std::abs(int{a.rgb[i]} - int{b.rgb[i]}));
    }
    levels.push_back(most);
  });
  return levels;
}

std::vector<TestVolume> stored_in_each_size(const Body& body) {
  std::vector<TestVolume> volumes;
  for (const glm::dvec3& edges_mm : kEdgesMm) {
    volumes.push_back(stored(body.inside, body.half_mm, edges_mm));
  }
  return volumes;
}

}  // namespace

TEST_CASE("a surface looks the same in voxels of 0.1 mm, of 0.5 mm and of 5 : 1") {
  if (!have_gl()) return;
  for (const Body& body : bodies()) {
    CAPTURE(std::string(body.name));
    const std::vector<TestVolume> volumes = stored_in_each_size(body);
    for (const std::string_view kind : {"iso", "surface", "cast"}) {
      CAPTURE(std::string(kind));
      const auto drawn = [&](const TestVolume& volume) {
        const VolumeContent content = volume.content();
        const auto renderer = make_renderer(kind, scene_of({&volume}), {&content, 1});
        return draw(*renderer, body.view, RenderTarget(kTestSize));
      };
      const Drawn fine = drawn(volumes.back());
      for (const TestVolume& volume : volumes) {
        CAPTURE(volume.view.edges_mm().x);
        CAPTURE(volume.view.edges_mm().z);
        const std::vector<int> levels = levels_apart(body, drawn(volume), fine);
        CHECK(levels.size() > 2000);
        CHECK(*std::max_element(levels.begin(), levels.end()) <= kMostLevels);
      }
    }
  }
}

// A plate is within a level more than a surface is, in single pixels. On a ball of ten voxels the
// lit layer is a fifth of the radius thick, so near the silhouette the light shows normals that are
// turned from the eye. With a ramp of presence as wide as a voxel plates were up to 6 levels apart;
// with a lit layer taken for twice as thick as it is, the ball up to 18.
TEST_CASE("what is translucent looks nearly the same in voxels of any size") {
  if (!have_gl()) return;
  constexpr int kMostOfPlates = kMostLevels + 1, kMostOfBall = 10, kMostMean = 2;
  for (const Body& body :
       {ball_body(), gap_body("wide gap", 2.2, look_at({0.9, 0, 2.4}, {-1.1, 0, 0.2}, 0.2, 20))}) {
    const bool ball = body.name == std::string("ball");
    CAPTURE(std::string(body.name));
    const std::vector<TestVolume> volumes = stored_in_each_size(body);
    for (const double opacity : {0.4, 0.1, 0.02}) {
      for (const std::string_view kind : {"blend", "slices", "cast-blend"}) {
        CAPTURE(opacity);
        CAPTURE(std::string(kind));
        const auto drawn = [&](const TestVolume& volume) {
          SceneView scene = scene_of({&volume});
          scene.materials = {{.name = "none"}, {.name = "bone", .iso = 0.5, .opacity = opacity}};
          const VolumeContent content = volume.content();
          const auto renderer = make_renderer(kind, scene, {&content, 1});
          return draw(*renderer, body.view, RenderTarget(kTestSize));
        };
        const Drawn fine = drawn(volumes.back());
        for (const TestVolume& volume : volumes) {
          CAPTURE(volume.view.edges_mm().x);
          CAPTURE(volume.view.edges_mm().z);
          const std::vector<int> levels = levels_apart(body, drawn(volume), fine);
          CHECK(levels.size() > 2000);
          CHECK(*std::max_element(levels.begin(), levels.end()) <=
                (ball ? kMostOfBall : kMostOfPlates));
          CHECK(std::accumulate(levels.begin(), levels.end(), 0.0) <=
                kMostMean * static_cast<double>(levels.size()));
        }
      }
    }
  }
}

}  // namespace kerf::voxel_size_test
