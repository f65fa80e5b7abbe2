// SPDX-License-Identifier: Apache-2.0
// Slices against the rays of blend: the same integral on another way.
#include <algorithm>
#include <array>
#include <cmath>

#include <doctest/doctest.h>

#include "tests/visualizer/gl/gl_fixture.hpp"
#include "tests/visualizer/render/renderer_fixture.hpp"
#include "visualizer/render/translucent_renderers.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

std::unique_ptr<Renderer> make_slices(const SceneView& scene,
                                      std::span<const VolumeContent> contents) {
  return std::make_unique<SlicesRenderer>(scene, contents);
}

}  // namespace

TEST_CASE("slices show what rays show, to 4/255 and a thousandth of a voxel in depth") {
  if (!have_gl()) return;
  const TestVolume volume = heap_of_balls();
  const VolumeContent content = volume.content();
  const SceneView scene = scene_of({&volume});
  const RenderTarget target(kTestSize);
  SlicesRenderer slices(scene, {&content, 1});
  BlendRenderer rays(scene, {&content, 1});
  for (const View& view : {look_at({14, 9, 20}, {}, 10, 40), look_at({-9, 9, 9}, {}, 5, 15),
                           look_at({0.1, 0.2, 0.3}, {5, 2, 1}, 0.5, 30)}) {  // the last from inside
    const Drawn a = draw(slices, view, target);
    const Drawn b = draw(rays, view, target);
    CHECK(difference(a, b).most <= 4);
    std::size_t apart = 0;
    for (std::size_t i = 0; i < a.depth.size(); ++i) {
      const double off_mm = eye_distance_mm(static_cast<double>(a.depth[i]), view) -
                            eye_distance_mm(static_cast<double>(b.depth[i]), view);
      apart += std::abs(off_mm) > 1e-3 * 0.2 ? 1 : 0;
    }
    // At a rim a rounding of the ray decides whether the first faint sample counts.
    CHECK(apart < a.depth.size() / 500);
  }
}

TEST_CASE("two intersecting volumes in slices are those of rays, to the depth of a slice") {
  if (!have_gl()) return;
  const VoxelGrid grid{40, 40, 40};
  const TestVolume a(grid, centred(grid, glm::dvec3(0.2), {-1.5, 0, 0}),
                     ball({-1.5, 0, 0}, 3, 0.4));
  const TestVolume b(grid, centred(grid, glm::dvec3(0.2), {1.5, 0, 0.4}),
                     ball({1.5, 0, 0.4}, 3, 0.4));
  const SceneView scene = scene_of({&a, &b});
  const std::array<VolumeContent, 2> contents{a.content(), b.content()};
  SlicesRenderer slices(scene, contents);
  BlendRenderer rays(scene, contents);
  const View view = look_at({3, 4, 29}, {}, 20, 40);
  const RenderTarget target(kTestSize);
  const Difference off = difference(draw(slices, view, target), draw(rays, view, target));
  CHECK(off.mean < 0.5);
  CHECK(off.most < 24);
}

TEST_CASE("while something moves the slices are fewer, and at rest the picture is as it was") {
  if (!have_gl()) return;
  const TestVolume volume = heap_of_balls();
  const VolumeContent content = volume.content();
  SlicesRenderer renderer(scene_of({&volume}), {&content, 1});
  const View view = look_at({14, 9, 20}, {}, 10, 40);
  const RenderTarget target(kTestSize);
  const Drawn rest = draw(renderer, view, target);
  renderer.set_moving(true);
  const Drawn moving = draw(renderer, view, target);
  CHECK(moving.rgb != rest.rgb);
  CHECK(difference(moving, rest).mean < 4.0);  // coarser, and the same scene
  renderer.set_moving(false);
  CHECK(draw(renderer, view, target).rgb == rest.rgb);
}

TEST_CASE("slices of changed bricks equal those of a fresh upload") {
  if (!have_gl()) return;
  check_updates(make_slices);
}

TEST_CASE("slices before an opaque thing dim it as the transfer function says") {
  if (!have_gl()) return;
  check_opaque_inside(make_slices);
}

TEST_CASE("a volume of air draws nothing") {
  if (!have_gl()) return;
  const VoxelGrid grid{16, 16, 16};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.5)), [](glm::dvec3) { return 0.0; });
  const VolumeContent content = volume.content();
  SlicesRenderer renderer(scene_of({&volume}), {&content, 1});
  const Drawn drawn = draw(renderer, look_at({0, 0, 30}, {}, 10, 50), RenderTarget(kTestSize));
  CHECK(*std::min_element(drawn.depth.begin(), drawn.depth.end()) == 1.0F);
}
