// SPDX-License-Identifier: Apache-2.0
// Rules that hold for every renderer: clip plane, part of a target, changed bricks, air.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <doctest/doctest.h>

#include "tests/visualizer/render/renderer_fixture.hpp"

namespace kerf::every_renderer_test {

using namespace kerf::test;

TEST_CASE("the clip plane leaves a face where it cuts through solid, and nothing before it") {
  if (!have_gl()) return;
  const VoxelGrid grid{40, 40, 40};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), ball({}, 3.5, 0.5));
  const VolumeContent content = volume.content();
  View view = look_at({0, 0, 30}, {}, 20, 40);
  view.clip_plane = {0, 0, -1, 1.03};  // z <= 1.03 mm
  for (const std::string_view kind : renderer_kinds()) {
    CAPTURE(std::string(kind));
    const auto renderer = make_renderer(kind, scene_of({&volume}), {&content, 1});
    renderer->set_cut_open(true, {&content, 1});
    const Drawn drawn = draw(*renderer, view, RenderTarget(kTestSize));
    CHECK(eye_distance_mm(static_cast<double>(drawn.depth[kMiddle]), view) ==
          doctest::Approx(28.97).epsilon(1e-5));
    CHECK(drawn.rgb[3 * kMiddle] > 60);  // lit
    for (const float depth : drawn.depth) {
      CHECK(eye_distance_mm(static_cast<double>(depth), view) > 28.969);
    }
  }
}

TEST_CASE("what lies behind the clip plane is not seen from before it, however near it lies") {
  if (!have_gl()) return;
  const VoxelGrid grid{40, 40, 40};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)),
                          [](glm::dvec3 at) { return at.z < -0.3 ? 1.0 : 0.0; });
  const VolumeContent content = volume.content();
  View view = look_at({3, 2, 30}, {}, 20, 40);
  view.clip_plane = {0, 0, 1, 0};  // z >= 0
  for (const std::string_view kind : renderer_kinds()) {
    CAPTURE(std::string(kind));
    const auto renderer = make_renderer(kind, scene_of({&volume}), {&content, 1});
    renderer->set_cut_open(true, {&content, 1});
    const Drawn drawn = draw(*renderer, view, RenderTarget(kTestSize));
    CHECK(std::count(drawn.rgb.begin(), drawn.rgb.end(), 0) ==
          static_cast<std::ptrdiff_t>(drawn.rgb.size()));
    for (const float depth : drawn.depth) CHECK(depth == 1.0F);
  }
}

TEST_CASE("iso, surface and cast show the same face in the clip plane, also after a cut") {
  if (!have_gl()) return;
  const VoxelGrid grid{48, 40, 36};
  // A soft core, which colours a part of the face.
  TestVolume volume(grid, centred(grid, {0.2, 0.25, 0.3}), [](glm::dvec3 at) {
    return ball({}, 3.5, 0.5)(at) - 0.4 * ball({0.5, 0.3, 0.0}, 1.2, 0.5)(at);
  });
  SceneView scene = scene_of({&volume});
  scene.materials = {
      {"none", 0.0, {0, 0, 0}}, {"dentin", 0.4, {0.8, 0.2, 0.1}}, {"enamel", 0.8, {0.2, 0.3, 0.9}}};
  const VolumeContent content = volume.content();
  View view = look_at({9, 12, 30}, {}, 20, 45);
  view.clip_plane = {0.0, -0.6, -0.8, 0.3};
  const RenderTarget target(kTestSize);
  std::vector<std::unique_ptr<Renderer>> renderers;
  for (const char* kind : {"iso", "surface", "cast"}) {
    renderers.push_back(make_renderer(kind, scene, {&content, 1}));
    renderers.back()->set_cut_open(true, {&content, 1});
  }
  const VoxelBox cut{{20, 14, 14}, {31, 22, 30}};
  for (const bool after : {false, true}) {
    if (after) {
      for_each_voxel(cut, [&](int x, int y, int z) { volume.density[grid.index(x, y, z)] = 0; });
      const auto changed = changed_in(volume.view.bricks, cut);
      for (const auto& renderer : renderers) renderer->update(0, volume.density, changed);
    }
    const Drawn iso = draw(*renderers[0], view, target);
    for (std::size_t other : {1U, 2U}) {
      const Drawn drawn = draw(*renderers[other], view, target);
      int face = 0, same = 0;
      for_each_pixel(view, [&](std::size_t at, const PixelRay& ray) {
        const auto eye_mm = eye_distance_mm(static_cast<double>(iso.depth[at]), view);
        const glm::dvec4 hit(ray.origin_mm + eye_mm * ray.direction, 1.0);
        if (std::abs(glm::dot(view.clip_plane, hit)) > 1e-3) return;
        ++face;
        bool equal = std::abs(drawn.depth[at] - iso.depth[at]) < 1e-6F;
        for (std::size_t c = 3 * at; c < 3 * at + 3; ++c) {
          equal = equal && std::abs(drawn.rgb[c] - iso.rgb[c]) <= 3;
        }
        same += equal ? 1 : 0;
      });
      CAPTURE(after);
      CAPTURE(other);
      CHECK(face > 1000);
      CHECK(same >= face * 0.995);
    }
  }
}

TEST_CASE("a face through one material has one colour, whichever cells a ray begins in") {
  if (!have_gl()) return;
  const VoxelGrid grid{40, 36, 44};
  const TestVolume volume(grid, centred(grid, {0.2, 0.25, 0.15}), [](glm::dvec3) { return 1.0; });
  const VolumeContent content = volume.content();
  const PictureSize size{320, 320};
  View view = look_at({9, 12, 30}, {}, 20, 45);
  for (const char* kind : {"iso", "surface", "cast"}) {
    CAPTURE(std::string(kind));
    const auto renderer = make_renderer(kind, scene_of({&volume}), {&content, 1});
    renderer->set_cut_open(true, {&content, 1});
    for (double at_mm = -1.0; at_mm <= 1.0; at_mm += 0.25) {
      CAPTURE(at_mm);
      view.clip_plane = {0.0, -0.6, -0.8, at_mm};
      const Drawn drawn = draw(*renderer, view, RenderTarget(size));
      std::vector<std::size_t> face;
      for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
          const auto at = static_cast<std::size_t>(y * size.width + x);
          const PixelRay ray = pixel_ray(view, size, x, y);
          const double mm = eye_distance_mm(static_cast<double>(drawn.depth[at]), view);
          const glm::dvec4 hit(ray.origin_mm + mm * ray.direction, 1.0);
          // Not where the surface of the body is that near.
          const bool inside = std::abs(hit.x) < 3.7 && std::abs(hit.y) < 4.1 && std::abs(hit.z) < 3;
          if (inside && std::abs(glm::dot(view.clip_plane, hit)) < 1e-3) face.push_back(at);
        }
      }
      REQUIRE(face.size() > 5000);
      const std::size_t middle = face[face.size() / 2];
      int others = 0;
      for (const std::size_t at : face) {
        for (std::size_t c = 0; c < 3; ++c) {
          if (std::abs(drawn.rgb[3 * at + c] - drawn.rgb[3 * middle + c]) > 3) ++others;
        }
      }
      CHECK(others == 0);
    }
  }
}

TEST_CASE("a face in the clip plane has the colour of what lies in it, not behind it") {
  if (!have_gl()) return;
  const VoxelGrid grid{32, 32, 32};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)),
                          [](glm::dvec3 at) { return at.z > 1.0 ? 0.5 : 1.0; });
  SceneView scene = scene_of({&volume});
  scene.volumes[0].iso = 20'000;
  scene.materials = {
      {"none", 0.0, {0, 0, 0}}, {"red", 0.3, {0.8, 0.1, 0.1}}, {"blue", 0.8, {0.1, 0.1, 0.8}}};
  const VolumeContent content = volume.content();
  View view = look_at({0, 0, 30}, {}, 20, 40);
  for (const char* kind : {"iso", "surface", "cast"}) {
    CAPTURE(std::string(kind));
    const auto renderer = make_renderer(kind, scene, {&content, 1});
    renderer->set_cut_open(true, {&content, 1});
    const std::size_t middle = 3 * kMiddle;
    view.clip_plane = {0, 0, -1, 1.125};  // through the last red voxels
    const Drawn red = draw(*renderer, view, RenderTarget(kTestSize));
    CHECK(red.rgb[middle] > 2 * red.rgb[middle + 2]);
    view.clip_plane = {0, 0, -1, 0.875};
    const Drawn blue = draw(*renderer, view, RenderTarget(kTestSize));
    CHECK(blue.rgb[middle + 2] > 2 * blue.rgb[middle]);
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
    renderer->set_cut_open(true, {&content, 1});
    View view = all;
    view.clip_plane = {1, 0, 0, 4.0};
    CHECK(draw(*renderer, view, target).rgb == whole.rgb);
    view.clip_plane = {1, 0, 0, -4.0};
    for (const float depth : draw(*renderer, view, target).depth) CHECK(depth == 1.0F);
  }
}

TEST_CASE("within a part of the target the pixels are those of the whole, the others stay") {
  if (!have_gl()) return;
  const TestVolume volume = heap_of_balls();
  const VolumeContent content = volume.content();
  const View view = look_at({14, 9, 20}, {}, 10, 40);
  RenderTarget target(kTestSize);
  std::mt19937 random(3);
  const auto pick = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
  for (const std::string_view kind : renderer_kinds()) {
    CAPTURE(std::string(kind));
    const auto renderer = make_renderer(kind, scene_of({&volume}), {&content, 1});
    const Drawn whole = draw(*renderer, view, target);
    for (int round = 0; round < 8; ++round) {
      const PixelRect at{pick(96), pick(96), 0, 0};
      const PixelRect part = PixelRect{at.x0, at.y0, at.x0 + 1 + pick(60), at.y0 + 1 + pick(60)};
      target.bind();
      glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
      target.restrict_to(part.clipped(target.all()));
      renderer->draw(view, target);
      target.restrict_to(target.all());
      const auto rgb = target.read_rgb();
      const auto depth = target.read_depth();
      int wrong = 0;
      for (std::size_t i = 0; i < depth.size(); ++i) {
        const int x = static_cast<int>(i) % kTestSize.width;
        const int up = kTestSize.height - 1 - static_cast<int>(i) / kTestSize.width;
        const bool inside = x >= part.x0 && x < part.x1 && up >= part.y0 && up < part.y1;
        wrong += depth[i] != (inside ? whole.depth[i] : 1.0F) ? 1 : 0;
        wrong += rgb[3 * i] != (inside ? whole.rgb[3 * i] : 0) ? 1 : 0;
      }
      CHECK(wrong == 0);
    }
  }
}

TEST_CASE("after random cuts, the changed bricks make the picture of a renderer made anew") {
  if (!have_gl()) return;
  const VoxelGrid grid{43, 37, 50};
  const RenderTarget target(kTestSize);
  const View view = look_at({9, 14, 17}, {}, 15, 35);
  for (const std::string_view kind : renderer_kinds()) {
    CAPTURE(std::string(kind));
    for (const GradientFilter gradient :
         {GradientFilter::corners, GradientFilter::central, GradientFilter::farid5}) {
      TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), ball({}, 4.4, 0.5));
      SceneView scene = scene_of({&volume});
      scene.gradient = gradient;
      const VolumeContent content = volume.content();
      const auto edited = make_renderer(kind, scene, {&content, 1});
      std::mt19937 random(11);
      for (int cut = 0; cut < 13; ++cut) {
        // Noise makes many surfaces; what grows back makes cells active again; the last takes all.
        VoxelBox box = grid.box();
        if (cut < 12) box = fill_random_box(volume, cut % 3 == 2 ? 60000 : 0, random);
        for_each_voxel(box, [&](int x, int y, int z) {
          Density& density = volume.density[grid.index(x, y, z)];
          if (cut % 3 == 1) density = static_cast<Density>(random());
          if (cut == 12) density = 0;
        });
        edited->update(0, volume.density, changed_in(volume.view.bricks, box));
        const Drawn last = draw(*edited, view, target);
        const Drawn anew = draw(*make_renderer(kind, scene, {&content, 1}), view, target);
        CHECK(last.rgb == anew.rgb);
        CHECK(last.depth == anew.depth);
        const bool shows = *std::min_element(last.depth.begin(), last.depth.end()) < 1.0F;
        CHECK(shows == (cut < 12));
      }
    }
  }
}

TEST_CASE("surface redraws by changed cells while a plane cuts it open, else by triangles alone") {
  if (!have_gl()) return;
  const VoxelGrid grid{24, 24, 24};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), ball({}, 2.0, 0.5));
  const VolumeContent content = volume.content();
  const auto renderer = make_renderer("surface", scene_of({&volume}), {&content, 1});
  const RenderTarget target(kTestSize);
  const View view = look_at({0, 0, 20}, {}, 10, 30);
  static_cast<void>(draw(*renderer, view, target));
  // Brought without another density: no triangle changes.
  renderer->update(0, volume.density, changed_in(volume.view.bricks, {{8, 8, 8}, {12, 13, 14}}));
  for (const bool open : {false, true, false}) {
    renderer->set_cut_open(open, {&content, 1});
    RedrawTiles tiles(kTestSize);
    renderer->mark_redraw(0, {volume.view, view, target}, tiles);
    CHECK(tiles.rects().empty() == !open);
  }
}

}  // namespace kerf::every_renderer_test
