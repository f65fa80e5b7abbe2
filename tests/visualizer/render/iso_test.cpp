// SPDX-License-Identifier: Apache-2.0
// Rays to an iso-surface: where they begin, where they end, what they cannot pass over.
#include <algorithm>
#include <cmath>

#include <doctest/doctest.h>

#include "tests/visualizer/render/renderer_fixture.hpp"
#include "visualizer/compose/tool_painter.hpp"
#include "visualizer/render/translucent_renderers.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf::iso_test {

using namespace kerf::test;

namespace {

Drawn draw_iso(const TestVolume& volume, const View& view) {
  const VolumeContent content = volume.content();
  IsoRenderer renderer(scene_of({&volume}), {&content, 1});
  return draw(renderer, view, RenderTarget(kTestSize));
}

}  // namespace

TEST_CASE(
    "rays that begin and end inside one body begin there, whatever lies beyond the far plane") {
  if (!have_gl()) return;
  // A wide body around the eye, a gap, and a thin one. Rays leave the gap in a higher row of cells
  // than they came into it by, and enter the thin body by a later face than they leave it by.
  const VoxelGrid grid{120, 24, 120};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), [](glm::dvec3 at) {
    return at.x > 0.0 || (at.x < -10.0 && at.x > -12.0) ? 1.0 : 0.0;
  });
  const glm::dvec3 eye(6.0, 0.1, -9.0);
  View view = look_at(eye, eye + glm::dvec3(-1.0, 0.0, 0.45), 0.5, 2.0);
  view.tan_half_height = 0.1;
  for (const float depth : draw_iso(volume, view).depth) CHECK(depth < 1.0F);
}

TEST_CASE("with the eye inside the volume's box the hollow around it is seen whole") {
  if (!have_gl()) return;
  const VoxelGrid grid{48, 48, 48};
  const auto hollow = ball({}, 3.0, 0.5);
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)),
                          [&](glm::dvec3 at) { return 1.0 - std::clamp(hollow(at), 0.0, 1.0); });
  const View view = look_at({0.2, 0.1, 0}, {1, 2, 3}, 0.05, 20);
  const Drawn drawn = draw_iso(volume, view);
  double worst_mm = 0.0;
  for_each_pixel(view, [&](std::size_t at, const PixelRay& ray) {
    const double eye_mm = eye_distance_mm(static_cast<double>(drawn.depth[at]), view);
    const double radius_mm = glm::length(ray.origin_mm + eye_mm * ray.direction);
    worst_mm = std::max(worst_mm, std::abs(radius_mm - 3.0));
  });
  CHECK(worst_mm < 0.25 * 0.25);
}

TEST_CASE("voxels of the iso density alone, such as full ones at 1, look alike by each renderer") {
  if (!have_gl()) return;
  const VoxelGrid grid{24, 24, 24};
  struct Body {
    double full;
    glm::dvec3 half_mm;
  };
  for (const Body& body : {Body{1.0, glm::dvec3(2.0)}, Body{0.6, glm::dvec3(2.0)},
                           Body{1.0, {2.0, 0.1, 2.0}}}) {  // the last one is a layer of voxels
    TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), [&](glm::dvec3 at) {
      const glm::dvec3 from = glm::abs(at - glm::dvec3(0.13));
      return glm::all(glm::lessThan(from, body.half_mm)) ? body.full : 0.0;
    });
    volume.view.iso = *std::max_element(volume.density.begin(), volume.density.end());
    const VolumeContent content = volume.content();
    const View view = look_at({4, 6, 9}, {}, 2, 30);
    const RenderTarget target(kTestSize);
    const auto seen_by = [&](const char* kind) {
      const auto renderer = make_renderer(kind, scene_of({&volume}), {&content, 1});
      const std::vector<float> depth = draw(*renderer, view, target).depth;
      return std::count_if(depth.begin(), depth.end(), [](float one) { return one < 1.0F; });
    };
    const auto by_surface = seen_by("surface");
    CHECK(by_surface > 500);
    for (const char* kind : {"iso", "cast"}) {
      CAPTURE(kind);
      CAPTURE(body.full);
      CAPTURE(body.half_mm.y);
      CHECK(std::abs(seen_by(kind) - by_surface) <= by_surface / 50);
    }
  }
}

TEST_CASE("a volume that is solid up to its border is closed there") {
  if (!have_gl()) return;
  const VoxelGrid grid{16, 16, 16};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.5)), [](glm::dvec3) { return 1.0; });
  const View view = look_at({0, 0, 30}, {}, 10, 50);
  // Half density half a voxel beyond the last centre: z = 7.5 * 0.5 + 0.25.
  const auto depth = static_cast<double>(draw_iso(volume, view).depth[kMiddle]);
  CHECK(eye_distance_mm(depth, view) == doctest::Approx(26.0).epsilon(0.001));
}

TEST_CASE("a volume beyond the driver's limit is refused, and the limit is named") {
  if (!have_gl()) return;
  const VoxelGrid grid{31, 8, 8};
  const TestVolume volume(grid, glm::dmat4(1.0), [](glm::dvec3) { return 0.0; });
  CHECK_NOTHROW(VolumeOnGpu(volume.view, volume.content(), 33, true, kDefaultGradient));
  CHECK_THROWS_WITH_AS(
      VolumeOnGpu(volume.view, volume.content(), 32, true, kDefaultGradient),
      "volume test: 31x8x8 voxels, and this OpenGL driver takes 30 a side; crop or "
      "resample it",
      VisualizerError);
}

TEST_CASE("skipping empty cells changes no pixel") {
  if (!have_gl()) return;
  const TestVolume volume = heap_of_balls();
  const VolumeContent content = volume.content();
  const SceneView scene = scene_of({&volume});
  const RenderTarget target(kTestSize);
  IsoRenderer iso(scene, {&content, 1}), all_of_iso(scene, {&content, 1}, {.skip_empty = false});
  BlendRenderer blend(scene, {&content, 1}),
      all_of_blend(scene, {&content, 1}, {.skip_empty = false});
  // From outside, from the middle of the heap, and with the far plane inside the box.
  for (const View& view :
       {look_at({14, 9, 20}, {}, 10, 40), look_at({0.1, 0.2, 0.3}, {5, 2, 1}, 0.05, 30),
        look_at({-9, 9, 9}, {}, 5, 15)}) {
    for (const auto& [skips, samples_all] :
         {std::pair<Renderer*, Renderer*>{&iso, &all_of_iso}, {&blend, &all_of_blend}}) {
      const Drawn a = draw(*skips, view, target), b = draw(*samples_all, view, target);
      CHECK(a.rgb == b.rgb);
      CHECK(a.depth == b.depth);
      CHECK(*std::min_element(a.depth.begin(), a.depth.end()) < 1.0F);
    }
  }
}

TEST_CASE("the part of the force arrow inside the volume shines through and leaves depth alone") {
  if (!have_gl()) return;
  const VoxelGrid grid{40, 40, 40};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.2)), ball({}, 3.0, 0.4));
  const VolumeContent content = volume.content();
  IsoRenderer renderer(scene_of({&volume}), {&content, 1});
  MeshPainter painter;
  const View view = look_at({0, 0, 30}, {}, 20, 40);
  const RenderTarget target(kTestSize);
  const Drawn alone = draw(renderer, view, target);
  painter.draw_arrow({0, -2, 0}, {0, 2, 0}, 0.2, {}, view, target);
  CHECK(target.read_depth() == alone.depth);
  CHECK(target.read_rgb() != alone.rgb);
  static_cast<void>(draw(renderer, view, target));
  painter.draw_arrow({0, 0, 0}, {0, 0, 0}, 0.2, {}, view, target);  // no force, no arrow
  CHECK(target.read_rgb() == alone.rgb);
}

}  // namespace kerf::iso_test
