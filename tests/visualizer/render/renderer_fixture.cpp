// SPDX-License-Identifier: Apache-2.0
#include "tests/visualizer/render/renderer_fixture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <random>

#include <doctest/doctest.h>

namespace kerf::test {

namespace {

constexpr double kBlockMm = 4.0;

Drawn draw_before_wall(Renderer& renderer, const View& view, const RenderTarget& target,
                       float brightness, double wall_mm) {
  target.bind();
  glClearColor(brightness, brightness, brightness, 1.0F);
  glClearDepth(window_depth(wall_mm, view.near_mm, view.far_mm));
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glClearDepth(1.0);
  renderer.draw(view, target);
  return {target.read_rgb(), target.read_depth()};
}

}  // namespace

SceneView scene_of(std::initializer_list<const TestVolume*> volumes) {
  SceneView scene;
  for (const TestVolume* volume : volumes) scene.volumes.push_back(volume->view);
  return scene;
}

TestVolume heap_of_balls() {
  const VoxelGrid grid{61, 44, 37};
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-4.0, 4.0);
  std::vector<glm::dvec3> centres(25);
  for (glm::dvec3& centre : centres) {
    for (int axis = 0; axis < 3; ++axis) centre[axis] = place(random);
  }
  return {grid, centred(grid, glm::dvec3(0.2)), [&](glm::dvec3 at) {
            double most = 0.0;
            for (const glm::dvec3& centre : centres) {
              most = std::max(most, ball(centre, 0.7, 0.4)(at));
            }
            return most;
          }};
}

TestVolume solid_block(glm::dvec3 spacing_mm, glm::dvec3 centre_mm) {
  const glm::dvec3 n = glm::round(kBlockMm / spacing_mm);
  const VoxelGrid grid{static_cast<int>(n.x), static_cast<int>(n.y), static_cast<int>(n.z)};
  return {grid, centred(grid, spacing_mm, centre_mm), [](glm::dvec3) { return 1.0; }};
}

double transparency(const TestVolume& block, double light_mm) {
  const TransferFunction transfer = make_transfer_function({}, block.view.iso, false);
  const double edge_mm = block.view.world_from_voxel[0][0];
  const double opacity = static_cast<double>(transfer.materials[0][255].a);
  // From the centre of the last voxels the density falls to zero over one edge.
  const double last_centre_mm = 0.5 * (kBlockMm - edge_mm);
  const double border_edges = 1.0 - 0.5 * (transfer.empty + transfer.full);
  const double edges = (last_centre_mm - light_mm) / edge_mm + border_edges;
  return std::pow(1.0 - opacity, edges);
}

double shown(double transparency) {
  return 1.0 - std::min((1.0 - transparency) / 0.98, 1.0);
}

double seen_through(Renderer& renderer, const View& view, double wall_mm) {
  const RenderTarget target(kTestSize);
  const Drawn white = draw_before_wall(renderer, view, target, 1.0F, wall_mm);
  const Drawn black = draw_before_wall(renderer, view, target, 0.0F, wall_mm);
  const std::size_t middle = 3 * pixel_at(kTestSize.width / 2, kTestSize.height / 2);
  return (white.rgb[middle] - black.rgb[middle]) / 255.0;
}

Difference difference(const Drawn& a, const Drawn& b) {
  Difference difference;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) {
    const int off = std::abs(static_cast<int>(a.rgb[i]) - static_cast<int>(b.rgb[i]));
    difference.mean += off;
    difference.most = std::max(difference.most, off);
  }
  difference.mean /= static_cast<double>(a.rgb.size());
  return difference;
}

void check_skipping(const MakeRenderer& skipping, const MakeRenderer& plain) {
  const TestVolume volume = heap_of_balls();
  const VolumeContent content = volume.content();
  const SceneView scene = scene_of({&volume});
  const RenderTarget target(kTestSize);
  const auto skips = skipping(scene, {&content, 1});
  const auto looks_everywhere = plain(scene, {&content, 1});
  for (const View& view :
       {look_at({14, 9, 20}, {}, 10, 40), look_at({0.1, 0.2, 0.3}, {5, 2, 1}, 0.05, 30),
        look_at({-9, 9, 9}, {}, 5, 15)}) {
    const Drawn a = draw(*skips, view, target);
    const Drawn b = draw(*looks_everywhere, view, target);
    CHECK(a.rgb == b.rgb);
    CHECK(a.depth == b.depth);
    CHECK(*std::min_element(a.depth.begin(), a.depth.end()) < 1.0F);
  }
}

void check_updates(const MakeRenderer& make) {
  const VoxelGrid grid{43, 37, 50};
  TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), ball({}, 4.4, 0.5));
  const SceneView scene = scene_of({&volume});
  VolumeContent content = volume.content();
  const auto edited = make(scene, {&content, 1});
  const RenderTarget target(kTestSize);
  const View view = look_at({9, 14, 17}, {}, 15, 35);
  const Drawn whole = draw(*edited, view, target);
  std::mt19937 random(11);
  Drawn last = whole;
  for (int cut = 0; cut < 12; ++cut) {
    // Grows back in every third cut: cells become active again too.
    const VoxelBox box = fill_random_box(volume, cut % 3 == 2 ? 60000 : 0, random);
    edited->update(0, volume.density, changed_in(volume.view.bricks, box));
    content = volume.content();
    const auto fresh = make(scene, {&content, 1});
    last = draw(*edited, view, target);
    const Drawn anew = draw(*fresh, view, target);
    CHECK(last.rgb == anew.rgb);
    CHECK(last.depth == anew.depth);
  }
  CHECK(last.rgb != whole.rgb);
}

void check_opaque_inside(const MakeRenderer& make) {
  const TestVolume block = solid_block(glm::dvec3(0.25), {0, 0, 0});
  const VolumeContent content = block.content();
  const auto renderer = make(scene_of({&block}), {&content, 1});
  const View view = look_at({0, 0, 30}, {}, 10, 50);
  for (const double wall_mm : {1.7, 1.4, 1.13, 0.9}) {
    CAPTURE(wall_mm);
    CHECK(seen_through(*renderer, view, 30.0 - wall_mm) ==
          doctest::Approx(shown(transparency(block, wall_mm))).epsilon(0.03));
  }
  CHECK(seen_through(*renderer, view, 20.0) == 1.0);  // before the block
  CHECK(seen_through(*renderer, view, 45.0) == 0.0);  // behind all of it
}

}  // namespace kerf::test
