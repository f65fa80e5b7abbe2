// SPDX-License-Identifier: Apache-2.0
// Normals of surfaces that are known: a ball, also in voxels with unequal edges, as a CT of thick
// slices has them, and a volume one voxel thick.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <string>

#include <doctest/doctest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "shared/numeric/statistics.hpp"
#include "shared/posix/atomic_file.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/visualizer/render/renderer_fixture.hpp"
#include "visualizer/bench/picture_bench.hpp"
#include "visualizer/cast/caster.hpp"
#include "visualizer/surface/volume_surface.hpp"

namespace kerf::unequal_voxels_test {

using namespace kerf::test;

namespace {

constexpr double kRadiusMm = 2.8;
constexpr glm::dvec3 kCentreMm{0.013, -0.027, 0.041};  // on no voxel
// At 99 of 100 points. The steps of full and empty voxels show: cubes leave 3.5 of them.
constexpr double kMostDegrees = 3.0, kMostOfBinary = 3.7;
constexpr double kLeastFacing = 0.342;  // a normal is turned to the eye on the edge

enum class Border { partial, binary };

/// The fraction of a voxel that the ball fills: along z exactly, over 6x6 lines.
double filled_fraction(const glm::dvec3& at, const glm::dvec3& edges_mm) {
  constexpr int kLines = 6;
  const glm::dvec3 from = at - kCentreMm;
  const double away = glm::length(from);
  const double reach = 0.5 * glm::length(edges_mm);
  if (away >= kRadiusMm + reach) return 0.0;
  if (away <= kRadiusMm - reach) return 1.0;
  double sum = 0.0;
  for (int line = 0; line < kLines * kLines; ++line) {
    const glm::dvec2 place((line % kLines + 0.5) / kLines - 0.5,
                           (line / kLines + 0.5) / kLines - 0.5);
    const glm::dvec2 aside = glm::dvec2(from) + place * glm::dvec2(edges_mm);
    const double half_2 = kRadiusMm * kRadiusMm - glm::dot(aside, aside);
    if (half_2 <= 0.0) continue;
    const double half = std::sqrt(half_2);
    const double top = std::min(half, from.z + 0.5 * edges_mm.z);
    sum += std::max(0.0, top - std::max(-half, from.z - 0.5 * edges_mm.z)) / edges_mm.z;
  }
  return sum / (kLines * kLines);
}

TestVolume ball_in(const glm::dvec3& edges_mm, Border border) {
  const auto count = [](double edge_mm) {
    return 2 * static_cast<int>(std::ceil(kRadiusMm / edge_mm + 2.0)) + 1;
  };
  const VoxelGrid grid{count(edges_mm.x), count(edges_mm.y), count(edges_mm.z)};
  return {grid, centred(grid, edges_mm), [&](glm::dvec3 at) {
            if (border == Border::partial) return filled_fraction(at, edges_mm);
            return glm::length(at - kCentreMm) < kRadiusMm ? 1.0 : 0.0;
          }};
}

double degrees_between(const glm::dvec3& a, const glm::dvec3& b) {
  return 2.0 * std::asin(std::min(0.5 * glm::length(a - b), 1.0)) * 180.0 / std::numbers::pi;
}

struct Angles {
  double rms = 0.0, p99 = 0.0;
  explicit Angles(std::vector<double> degrees) {
    for (const double one : degrees) rms += one * one;
    rms = std::sqrt(rms / static_cast<double>(degrees.size()));
    p99 = percentile(degrees, 0.99);
  }
};

/// Of the vertices that an exported file has.
Angles of_mesh(const TestVolume& volume, GradientFilter gradient) {
  ClosedMesh mesh;
  mesh.append(VolumeSurface(volume.view, {}, volume.density, {}, gradient),
              volume.view.world_from_voxel);
  std::vector<double> degrees;
  for (const ClosedMesh::Vertex& vertex : mesh.vertices) {
    const glm::dvec3 outward = glm::normalize(glm::dvec3(vertex.position_mm) - kCentreMm);
    degrees.push_back(degrees_between(vertex.normal, outward));
  }
  REQUIRE(degrees.size() > 500);
  return Angles(degrees);
}

/// The normal of a body at a point of its surface, or none if the point does not count.
using Outward = std::function<std::optional<glm::dvec3>(const glm::dvec3& at_mm)>;
std::optional<glm::dvec3> outward_of_ball(const glm::dvec3& at_mm) {
  return glm::normalize(at_mm - kCentreMm);
}

/// Of the pixels of three views; `normal_at` draws one and gives the normal of each pixel, in eye
/// space.
template <class Draw>
Angles of_pixels(const Outward& outward_at, const Draw& drawn_from) {
  std::vector<double> degrees;
  for (const glm::dvec3& eye :
       {glm::dvec3(7, 15, 19), glm::dvec3(-22, 4, 7), glm::dvec3(3, -9, -20)}) {
    const View view = look_at(eye, {}, 10, 40);
    const auto [depth, normal_at] = drawn_from(view);
    for_each_pixel(view, [&](std::size_t at, const PixelRay& ray) {
      if (depth(at) >= 1.0F) return;
      const double t = eye_distance_mm(static_cast<double>(depth(at)), view);
      const std::optional<glm::dvec3> outward = outward_at(ray.origin_mm + t * ray.direction);
      if (!outward || -glm::dot(*outward, glm::normalize(ray.direction)) < kLeastFacing) return;
      const glm::dvec3 wanted(view.eye_from_world * glm::dvec4(*outward, 0.0));
      degrees.push_back(degrees_between(normal_at(at), wanted));
    });
  }
  REQUIRE(degrees.size() > 1000);
  return Angles(degrees);
}

Angles of_cast(const TestVolume& volume, const Outward& outward = outward_of_ball) {
  const CastContent content{volume.density, {}, {}};
  Caster caster(scene_of({&volume}), {&content, 1}, {});
  CastPicture picture;
  picture.resize(kTestSize.width, kTestSize.height);
  std::vector<float> normals(3 * picture.depth.size());
  const auto upside = [](std::size_t at) {  // its rows go from the bottom up
    const auto width = static_cast<std::size_t>(kTestSize.width);
    return (static_cast<std::size_t>(kTestSize.height) - 1 - at / width) * width + at % width;
  };
  return of_pixels(outward, [&](const View& view) {
    caster.draw(view, picture.whole(), picture, {}, normals);
    return std::pair([&](std::size_t at) { return picture.depth[upside(at)]; },
                     [&](std::size_t at) {
                       const float* const n = &normals[3 * upside(at)];
                       return glm::dvec3(n[0], n[1], n[2]);
                     });
  });
}

Angles of_iso(const TestVolume& volume, const Outward& outward = outward_of_ball) {
  const VolumeContent content = volume.content();
  IsoRenderer renderer(scene_of({&volume}), {&content, 1}, {.light = "normals.frag"});
  Drawn drawn;
  return of_pixels(outward, [&](const View& view) {
    drawn = draw(renderer, view, RenderTarget(kTestSize));
    return std::pair([&](std::size_t at) { return drawn.depth[at]; },
                     [&](std::size_t at) { return shown_normal(&drawn.rgb[3 * at]); });
  });
}

/// Ratios of edges; 0.1 mm is the shortest.
constexpr glm::dvec3 kRatios[]{{1, 1, 1}, {1, 1, 1.5}, {1, 1, 2},  {2, 1, 1},
                               {1, 3, 1}, {1, 1, 5},   {5, 1, 1},  {1, 5, 5},
                               {1, 2, 8}, {1, 10, 10}, {1, 1, 10}, {1, 1, 3.7}};

}  // namespace

TEST_CASE(
    "normals of a ball are right with voxels of 1 : 1 to 1 : 10, in every renderer and in a file") {
  for (const glm::dvec3& ratio : kRatios) {
    for (const Border border : {Border::partial, Border::binary}) {
      const TestVolume volume = ball_in(0.1 * ratio, border);
      CAPTURE(ratio.x);
      CAPTURE(ratio.y);
      CAPTURE(ratio.z);
      CAPTURE(static_cast<int>(border));
      const Angles mesh = of_mesh(volume, kDefaultGradient);
      const Angles cast = of_cast(volume);
      const double most = border == Border::partial ? kMostDegrees : kMostOfBinary;
      CHECK(mesh.p99 < most);
      CHECK(cast.p99 < most);
      if (have_gl()) CHECK(of_iso(volume).p99 < most);
    }
  }
}

TEST_CASE("a volume one voxel thick has the normals of its two faces") {
  for (const int axis : {0, 1, 2}) {
    for (const double thick_mm : {0.1, 0.3}) {
      CAPTURE(axis);
      CAPTURE(thick_mm);
      glm::ivec3 count(81);
      glm::dvec3 edges_mm(0.1);
      count[axis] = 1;
      edges_mm[axis] = thick_mm;
      const VoxelGrid grid{count.x, count.y, count.z};
      const TestVolume volume{grid, centred(grid, edges_mm), [](glm::dvec3) { return 1.0; }};
      const auto outward = [axis](const glm::dvec3& at_mm) -> std::optional<glm::dvec3> {
        glm::dvec3 along(0.0), aside = glm::abs(at_mm);
        along[axis] = at_mm[axis] < 0.0 ? -1.0 : 1.0;
        aside[axis] = 0.0;
        // Farther than the filter of edges of 0.3 mm reaches from its rim, which is a surface, too.
        if (std::max({aside.x, aside.y, aside.z}) > 2.4) return {};
        return along;
      };
      CHECK(of_cast(volume, outward).p99 < 0.5);
      if (have_gl()) CHECK(of_iso(volume, outward).p99 < 0.5);
    }
  }
}

TEST_CASE("a file has the normals of the gradient that was chosen") {
  const TestVolume volume = ball_in({0.1, 0.1, 0.5}, Border::partial);
  SceneView scene = scene_of({&volume});
  const VolumeContent content = volume.content();
  const TemporaryFolder folder;
  const auto written = [&](GradientFilter gradient) {
    scene.gradient = gradient;
    const auto file = folder / (std::string(name_of(gradient)) + ".ply");
    export_surface(file, scene, {&content, 1});
    return text_of(file);
  };
  CHECK(written(GradientFilter::central) != written(GradientFilter::adaptive));
  CHECK(written(GradientFilter::farid5) != written(GradientFilter::corners));
}

TEST_CASE(
    "after cuts in voxels of any size a picture is one made anew, and differs in its marked tiles "
    "alone") {
  if (!have_gl()) return;
  struct Case {
    glm::dvec3 edges_mm;
    double side_mm;     ///< of the volume, along x and y
    bool far_reaching;  ///< ambient occlusion joins all that is seen
  };
  const RenderTarget before(kTestSize), after(kTestSize);
  for (const auto& [edges_mm, side_mm, far_reaching] :
       {Case{{0.2, 0.2, 0.5}, 10.0, false}, Case{{1.1, 0.2, 0.3}, 10.0, false},
        Case{{0.1, 0.1, 0.1}, 5.0, false}, Case{{0.1, 0.1, 0.5}, 5.0, false},
        Case{{0.02, 0.02, 0.02}, 1.0, true}, Case{{0.02, 0.02, 2.0}, 1.0, true}}) {
    const auto count = [side = side_mm](double edge_mm) {
      return std::max(static_cast<int>(side / edge_mm), 3);
    };
    const VoxelGrid grid{count(edges_mm.x), count(edges_mm.y), count(edges_mm.z)};
    const View view =
        look_at(0.1 * side_mm * glm::dvec3(9, 14, 17), {}, 1.5 * side_mm, 3.5 * side_mm);
    for (const std::string_view kind : renderer_kinds()) {
      CAPTURE(std::string(kind));
      CAPTURE(edges_mm.x);
      TestVolume volume(grid, centred(grid, edges_mm), ball({}, 0.42 * side_mm, 0.05 * side_mm));
      const SceneView scene = scene_of({&volume});
      const VolumeContent content = volume.content();
      const auto renderer = make_renderer(kind, scene, {&content, 1});
      Drawn last = draw(*renderer, view, before);
      std::mt19937 random(5);
      int changed = 0, kept = 0;
      for (int cut = 0; cut < 6; ++cut) {
        const VoxelBox box = fill_random_box(volume, cut % 3 == 2 ? 60000 : 0, random);
        renderer->update(0, volume.density, changed_in(volume.view.bricks, box));
        if (renderer->translucent()) {
          before.bind();  // rays end at nothing
          glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        }
        RedrawTiles tiles(kTestSize);
        renderer->mark_redraw(0, {volume.view, view, before}, tiles);
        renderer->forget_changes();
        const Drawn now = draw(*renderer, view, after);
        const Drawn anew = draw(*make_renderer(kind, scene, {&content, 1}), view, after);
        CHECK(now.rgb == anew.rgb);
        int missed = 0;
        for_each_pixel(view, [&](std::size_t at, const PixelRay&) {
          const auto x = static_cast<int>(at) % kTestSize.width;
          const int up = kTestSize.height - 1 - static_cast<int>(at) / kTestSize.width;
          const bool marked = tiles.marked(x / RedrawTiles::kEdge, up / RedrawTiles::kEdge);
          const bool differs =
              !std::equal(&now.rgb[3 * at], &now.rgb[3 * at] + 3, &last.rgb[3 * at]);
          missed += differs && !marked ? 1 : 0;
          changed += differs ? 1 : 0;
          kept += marked ? 0 : 1;
        });
        CHECK(missed == 0);
        last = draw(*renderer, view, before);
      }
      CHECK(changed > 100);
      if (!far_reaching) CHECK(kept > 300);
    }
  }
}

}  // namespace kerf::unequal_voxels_test
