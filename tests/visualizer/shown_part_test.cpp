// SPDX-License-Identifier: Apache-2.0
// What every renderer leaves out on demand: what the clip plane takes, what is outside a rectangle.
#include <string>
#include <string_view>
#include <vector>

#include <doctest/doctest.h>

#include "tests/visualizer/gl_fixture.hpp"
#include "tests/visualizer/renderer_fixture.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

/// All but the shell: these have a face where they are cut.
std::vector<std::string_view> solid_kinds() {
  std::vector<std::string_view> kinds = renderer_kinds();
  std::erase(kinds, "surface");
  return kinds;
}

}  // namespace

TEST_CASE("the clip plane leaves a face where it cuts through solid, and nothing before it") {
  if (!have_gl()) return;
  const VoxelGrid grid{40, 40, 40};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), ball({}, 3.5, 0.5));
  const VolumeContent content = volume.content();
  View view = look_at({0, 0, 30}, {}, 20, 40);
  view.shown = {0, 0, -1, 1.03};  // z <= 1.03 mm
  for (const std::string_view kind : solid_kinds()) {
    CAPTURE(std::string(kind));
    const auto renderer = make_renderer(kind, scene_of({&volume}), {&content, 1});
    const Drawn drawn = draw(*renderer, view, RenderTarget(kTestSize));
    const std::size_t middle = pixel_at(48, 48);
    CHECK(eye_distance_mm(static_cast<double>(drawn.depth[middle]), view) ==
          doctest::Approx(28.97).epsilon(1e-5));
    CHECK(drawn.rgb[3 * middle] > 60);  // lit
    for (const float depth : drawn.depth) {
      CHECK(eye_distance_mm(static_cast<double>(depth), view) > 28.969);
    }
  }
}

TEST_CASE("a surface is a shell: opened by the clip plane, it shows its inner side at its depth") {
  if (!have_gl()) return;
  const VoxelGrid grid{40, 40, 40};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), ball({}, 3.5, 0.5));
  const VolumeContent content = volume.content();
  View view = look_at({0, 0, 30}, {}, 20, 40);
  const auto renderer = make_renderer("surface", scene_of({&volume}), {&content, 1});
  const RenderTarget target(kTestSize);
  const Drawn whole = draw(*renderer, view, target);
  view.shown = {0, 0, -1, 1.03};
  const Drawn opened = draw(*renderer, view, target);
  const std::size_t middle = pixel_at(48, 48);
  CHECK(eye_distance_mm(static_cast<double>(whole.depth[middle]), view) ==
        doctest::Approx(26.5).epsilon(1e-3));
  CHECK(eye_distance_mm(static_cast<double>(opened.depth[middle]), view) ==
        doctest::Approx(33.5).epsilon(1e-3));
  CHECK(opened.rgb[3 * middle] > 40);                     // lit
  CHECK(opened.rgb[3 * middle] < whole.rgb[3 * middle]);  // less than the outside
  for (const float depth : opened.depth) {
    CHECK(eye_distance_mm(static_cast<double>(depth), view) > 28.969);
  }
}

TEST_CASE("a plane beyond a volume hides it whole, one on its near side nothing") {
  if (!have_gl()) return;
  const VoxelGrid grid{24, 24, 24};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), ball({}, 2.0, 0.5));
  const VolumeContent content = volume.content();
  const View all = look_at({5, 7, 28}, {}, 20, 40);
  const RenderTarget target(kTestSize);
  for (const std::string_view kind : renderer_kinds()) {
    CAPTURE(std::string(kind));
    const auto renderer = make_renderer(kind, scene_of({&volume}), {&content, 1});
    const Drawn whole = draw(*renderer, all, target);
    View view = all;
    view.shown = {1, 0, 0, 4.0};
    CHECK(draw(*renderer, view, target).rgb == whole.rgb);
    view.shown = {1, 0, 0, -4.0};
    for (const float depth : draw(*renderer, view, target).depth) CHECK(depth == 1.0F);
  }
}

TEST_CASE(
    "within a part of the target the pixels are those of the whole picture, the others stay") {
  if (!have_gl()) return;
  const TestVolume volume = heap_of_balls();
  const VolumeContent content = volume.content();
  const View view = look_at({14, 9, 20}, {}, 10, 40);
  RenderTarget target(kTestSize);
  constexpr int kLeft = 31, kBottom = 22, kWide = 37, kHigh = 41;
  for (const std::string_view kind : renderer_kinds()) {
    CAPTURE(std::string(kind));
    const auto renderer = make_renderer(kind, scene_of({&volume}), {&content, 1});
    const Drawn whole = draw(*renderer, view, target);
    target.bind();
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    target.restrict_to({kLeft, kBottom, kLeft + kWide, kBottom + kHigh});
    renderer->draw(view, target);
    target.restrict_to(target.all());
    const auto rgb = target.read_rgb();
    const auto depth = target.read_depth();
    int wrong = 0;
    for (int y = 0; y < kTestSize.height; ++y) {
      for (int x = 0; x < kTestSize.width; ++x) {
        const int up = kTestSize.height - 1 - y;
        const bool inside =
            x >= kLeft && x < kLeft + kWide && up >= kBottom && up < kBottom + kHigh;
        const std::size_t at = pixel_at(x, y);
        wrong += depth[at] != (inside ? whole.depth[at] : 1.0F) ? 1 : 0;
        wrong += rgb[3 * at] != (inside ? whole.rgb[3 * at] : 0) ? 1 : 0;
      }
    }
    CHECK(wrong == 0);
  }
}
