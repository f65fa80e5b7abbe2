// SPDX-License-Identifier: Apache-2.0
// The surface renderer: true depth against a sphere, and the same picture as iso.
#include "visualizer/render/surface_renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <random>

#include <doctest/doctest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "tests/visualizer/render/renderer_fixture.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

constexpr PictureSize kSize{96, 96};

std::size_t pixel(int x, int y) {
  return static_cast<std::size_t>(y * kSize.width + x);
}

/// Root mean square of the depth's error against a sphere about the origin, in mm, where the
/// surface is not seen on edge; 1e9 where a pixel shows nothing.
double depth_error_mm(const Drawn& drawn, const View& view, double radius_mm) {
  double sum = 0.0;
  int pixels = 0;
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      const PixelRay ray = pixel_ray(view, kSize, x, y);
      const double a = glm::dot(ray.direction, ray.direction);
      const double b = glm::dot(ray.origin_mm, ray.direction);
      const double c = glm::dot(ray.origin_mm, ray.origin_mm) - radius_mm * radius_mm;
      const glm::dvec3 nearest = ray.origin_mm - b / a * ray.direction;
      if (glm::length(nearest) > 0.9 * radius_mm) continue;
      const auto depth = static_cast<double>(drawn.depth[pixel(x, y)]);
      if (depth >= 1.0) return 1e9;
      sum += std::pow(eye_distance_mm(depth, view) - (-b - std::sqrt(b * b - a * c)) / a, 2);
      ++pixels;
    }
  }
  return std::sqrt(sum / pixels);
}

std::array<std::vector<std::uint8_t>, 2> pictures_inside(const Drawn& a, const Drawn& b,
                                                         std::array<int, 4> box) {
  std::array<std::vector<std::uint8_t>, 2> both;
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      const int row = kSize.height - 1 - y;  // GL counts from the bottom
      if (x < box[0] || x >= box[0] + box[2] || row < box[1] || row >= box[1] + box[3]) continue;
      for (std::size_t i = 0; i < 3; ++i) {
        both[0].push_back(a.rgb[3 * pixel(x, y) + i]);
        both[1].push_back(b.rgb[3 * pixel(x, y) + i]);
      }
    }
  }
  return both;
}

}  // namespace

TEST_CASE("surface: the depth of a ball is that of the sphere, of second order in the voxel edge") {
  if (!have_gl()) return;
  const View view = look_at({9, 14, 17}, {}, 15, 35);
  std::vector<double> error_mm;
  for (const double edge_mm : {0.5, 0.25}) {
    const int side = static_cast<int>(std::lround(10.0 / edge_mm));
    const VoxelGrid grid{side, side, side};
    const TestVolume volume(grid, centred(grid, glm::dvec3(edge_mm)), ball({}, 4.0, 2.0));
    const VolumeContent content = volume.content();
    SurfaceRenderer renderer(scene_of({&volume}), {&content, 1});
    error_mm.push_back(depth_error_mm(draw(renderer, view, RenderTarget(kSize)), view, 4.0));
  }
  CHECK(error_mm[1] < 0.03 * 0.25);
  CHECK(std::log2(error_mm[0] / error_mm[1]) == doctest::Approx(2.0).epsilon(0.1));
}

TEST_CASE("surface: of two intersecting volumes the nearer one is seen, whatever their order") {
  if (!have_gl()) return;
  const VoxelGrid grid{40, 40, 40};
  const TestVolume a(grid, centred(grid, glm::dvec3(0.2), {-1, 0, 0}), ball({-1, 0, 0}, 3.0, 0.8));
  const TestVolume b(grid, centred(grid, glm::dvec3(0.2), {1, 0, 0.5}),
                     ball({1, 0, 0.5}, 3.0, 0.8));
  const View view = look_at({2, 3, 30}, {}, 20, 40);
  const RenderTarget target(kSize);
  const auto alone = [&](const TestVolume& volume) {
    const VolumeContent content = volume.content();
    SurfaceRenderer renderer(scene_of({&volume}), {&content, 1});
    return draw(renderer, view, target);
  };
  const Drawn only_a = alone(a);
  const Drawn only_b = alone(b);
  for (const bool swapped : {false, true}) {
    const TestVolume& first = swapped ? b : a;
    const TestVolume& second = swapped ? a : b;
    const std::array<VolumeContent, 2> contents{first.content(), second.content()};
    SurfaceRenderer renderer(scene_of({&first, &second}), contents);
    const Drawn both = draw(renderer, view, target);
    int wrong = 0;
    int from_a = 0;
    int from_b = 0;
    for (std::size_t i = 0; i < both.depth.size(); ++i) {
      wrong += both.depth[i] == std::min(only_a.depth[i], only_b.depth[i]) ? 0 : 1;
      from_a += only_a.depth[i] < only_b.depth[i] ? 1 : 0;
      from_b += only_b.depth[i] < only_a.depth[i] ? 1 : 0;
    }
    CHECK(wrong == 0);
    CHECK(from_a > 300);
    CHECK(from_b > 300);
  }
}

TEST_CASE("surface: after random cuts the picture equals that of a fresh upload, pixel by pixel") {
  if (!have_gl()) return;
  const VoxelGrid grid{43, 37, 50};
  TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), ball({}, 4.4, 0.5));
  const SceneView scene = scene_of({&volume});
  VolumeContent content = volume.content();
  SurfaceRenderer edited(scene, {&content, 1});
  const RenderTarget target(kSize);
  const View view = look_at({9, 14, 17}, {}, 15, 35);
  std::mt19937 random(11);
  const auto pick = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
  std::size_t differing = 0;
  for (int cut = 0; cut < 24; ++cut) {
    const VoxelIndex at{pick(grid.nx), pick(grid.ny), pick(grid.nz)};
    // The last one takes all that is left.
    const VoxelBox box =
        cut == 23
            ? grid.box()
            : VoxelBox{at, {at.x + 1, at.y + 1, at.z + 1}}.grown(2 + pick(6)).clipped(grid.box());
    for_each_voxel(box, [&](int x, int y, int z) {
      // Noise in every third cut: many more triangles than before.
      volume.density[grid.index(x, y, z)] = static_cast<Density>(cut % 3 == 1 ? pick(65536) : 0);
    });
    edited.update(0, volume.density, changed_in(volume.view.bricks, box));
    content = volume.content();
    SurfaceRenderer fresh(scene, {&content, 1});
    const Drawn a = draw(edited, view, target);
    const Drawn b = draw(fresh, view, target);
    differing += a.rgb != b.rgb || a.depth != b.depth ? 1 : 0;
    const bool shows = *std::min_element(a.depth.begin(), a.depth.end()) < 1.0F;
    CHECK(shows == (cut < 23));
  }
  CHECK(differing == 0);
}

TEST_CASE(
    "surface: inside a part of the target the picture is that of the whole, outside nothing "
    "changes") {
  if (!have_gl()) return;
  const VoxelGrid grid{64, 64, 64};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.15)), ball({}, 4.4, 0.5));
  const VolumeContent content = volume.content();
  SurfaceRenderer renderer(scene_of({&volume}), {&content, 1});
  RenderTarget target(kSize);
  const View view = look_at({9, 14, 17}, {}, 15, 35);
  const Drawn whole = draw(renderer, view, target);
  std::mt19937 random(3);
  const auto pick = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
  for (int i = 0; i < 20; ++i) {
    const std::array<int, 4> box{pick(96), pick(96), 1 + pick(40), 1 + pick(40)};
    target.bind();
    glClearColor(0.0F, 0.0F, 0.0F, 1.0F);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    target.restrict_to({box[0], box[1], box[0] + box[2], box[1] + box[3]});
    renderer.draw(view, target);
    target.restrict_to(target.all());
    const Drawn part{target.read_rgb(), target.read_depth()};
    const auto [in_part, in_whole] = pictures_inside(part, whole, box);
    CHECK(in_part == in_whole);
    std::size_t lit = 0;
    std::size_t lit_inside = 0;
    for (const std::uint8_t c : part.rgb) lit += c != 0;
    for (const std::uint8_t c : in_part) lit_inside += c != 0;
    CHECK(lit == lit_inside);
  }
}

TEST_CASE("surface and iso draw the same picture") {
  if (!have_gl()) return;
  const VoxelGrid grid{80, 72, 76};
  // Two materials by label, a groove and a deep well.
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.125)), [](glm::dvec3 at) {
    const double groove = 0.5 + (glm::length(at - glm::dvec3(2, 3, 3)) - 1.6) / 0.25;
    const double well = 0.5 + (std::hypot(at.x + 1.0, at.z - 1.0) - 0.6) / 0.25;
    return std::min({ball({}, 4.0, 0.25)(at), groove, at.y > 1.0 ? well : 1.0});
  });
  std::vector<Label> labels;
  for (std::size_t i = 0; i < volume.density.size(); ++i) {
    labels.push_back(volume.density[i] == 0 ? 0 : i / 80 % 72 > 40 ? 1 : 2);
  }
  SceneView scene = scene_of({&volume});
  scene.materials = {
      {"none", 0.0, {0, 0, 0}}, {"a", 0.8, {0.8, 0.75, 0.7}}, {"b", 0.4, {0.6, 0.2, 0.1}}};
  const View view = look_at({5, 22, 15}, {}, 15, 40);
  const RenderTarget target(kSize);
  for (const bool with_labels : {true, false}) {
    const VolumeContent content{
        volume.density, with_labels ? std::span<const Label>(labels) : std::span<const Label>()};
    SurfaceRenderer surface(scene, {&content, 1});
    IsoRenderer iso(scene, {&content, 1});
    const Drawn a = draw(surface, view, target);
    const Drawn b = draw(iso, view, target);
    int drawn = 0;
    int alike = 0;
    int near = 0;
    for (std::size_t i = 0; i < a.depth.size(); ++i) {
      if (a.depth[i] >= 1.0F && b.depth[i] >= 1.0F) continue;
      ++drawn;
      int off = 0;
      for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) {
        off = std::max(off, std::abs(int{a.rgb[c]} - int{b.rgb[c]}));
      }
      alike += off <= 8 ? 1 : 0;
      near += std::abs(eye_distance_mm(static_cast<double>(a.depth[i]), view) -
                       eye_distance_mm(static_cast<double>(b.depth[i]), view)) < 0.5 * 0.125
                  ? 1
                  : 0;
    }
    MESSAGE("of " << drawn << " pixels " << alike << " within 8/255, " << near
                  << " within half a voxel");
    CHECK(drawn > 2000);
    CHECK(alike > 0.98 * drawn);
    CHECK(near > 0.99 * drawn);
  }
}

TEST_CASE("surface redraws by changed cells while a plane cuts it open, else by triangles alone") {
  if (!have_gl()) return;
  const VoxelGrid grid{24, 24, 24};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), ball({}, 2.0, 0.5));
  const VolumeContent content = volume.content();
  const auto renderer = make_renderer("surface", scene_of({&volume}), {&content, 1});
  const RenderTarget target(kSize);
  const View view = look_at({0, 0, 20}, {}, 10, 30);
  static_cast<void>(draw(*renderer, view, target));
  // Brought without another density: no triangle changes.
  renderer->update(0, volume.density, changed_in(volume.view.bricks, {{8, 8, 8}, {12, 13, 14}}));
  for (const bool open : {false, true, false}) {
    renderer->set_cut_open(open, {&content, 1});
    RedrawTiles tiles(kSize);
    renderer->mark_redraw(0, {volume.view, volume.density, view, target}, tiles);
    CHECK(tiles.rects().empty() == !open);
  }
}
