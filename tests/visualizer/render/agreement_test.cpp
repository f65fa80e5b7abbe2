// SPDX-License-Identifier: Apache-2.0
// Renderers that compute one picture in different ways, against each other.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include <doctest/doctest.h>

#include "tests/visualizer/render/exact_body.hpp"
#include "tests/visualizer/render/renderer_fixture.hpp"
#include "tests/visualizer/render/teeth.hpp"

namespace kerf::agreement_test {

using namespace kerf::test;

namespace {

struct Agreement {
  int compared = 0;  ///< pixels that either one drew
  int alike = 0;     ///< channels within the steps, depth within half a voxel
  int near = 0;      ///< depth alone
};

Agreement agreement(const Drawn& a, const Drawn& b, const View& view, double voxel_mm, int steps) {
  Agreement found;
  for (std::size_t i = 0; i < a.depth.size(); ++i) {
    if (a.depth[i] >= 1.0F && b.depth[i] >= 1.0F) continue;
    ++found.compared;
    int worst = 0;
    for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) {
      worst = std::max(worst, std::abs(a.rgb[c] - b.rgb[c]));
    }
    const double apart_mm = eye_distance_mm(static_cast<double>(a.depth[i]), view) -
                            eye_distance_mm(static_cast<double>(b.depth[i]), view);
    if (std::abs(apart_mm) > 0.5 * voxel_mm) continue;
    ++found.near;
    found.alike += worst <= steps ? 1 : 0;
  }
  return found;
}

}  // namespace

TEST_CASE("iso and cast draw teeth alike, by labels and by density, also after a cut") {
  if (!have_gl()) return;
  const RenderTarget target({320, 320});
  constexpr VoxelGrid kSmall{128, 128, 80};
  std::vector<Tooth> teeth{phantom(kSmall, true), phantom(kSmall, false)};
  if (auto tooth = ct_tooth()) teeth.push_back(std::move(*tooth));
  for (Tooth& tooth : teeth) {
    const VolumeContent content = tooth.content();
    const auto iso = make_renderer("iso", tooth.scene, {&content, 1});
    const auto cast = make_renderer("cast", tooth.scene, {&content, 1});
    for (const bool drilled : {false, true}) {
      if (drilled) {
        const auto changed = tooth.drill();
        for (Renderer* const one : {iso.get(), cast.get()}) {
          one->update(0, tooth.image.density, changed);
        }
      }
      for (const View& view : {look_at({18, 22, 30}, {}, 20, 60), look_at({0, 40, 1}, {}, 20, 60),
                               look_at({-25, -8, 12}, {0, 2, 0}, 10, 60)}) {
        const Agreement found = agreement(draw(*iso, view, target), draw(*cast, view, target), view,
                                          tooth.image.spacing_mm[0], 3);
        CAPTURE(tooth.image.grid.nx);
        CAPTURE(tooth.labelled);
        CAPTURE(drilled);
        CHECK(found.compared > 5'000);
        CHECK(found.alike >= 0.995 * found.compared);
      }
    }
  }
}

TEST_CASE("shader and cast agree where the near and the far plane cut through solid") {
  if (!have_gl()) return;
  // Beyond a far plane in the ring's nearer side there is a hole, and more ring.
  const VoxelGrid grid{80, 36, 80};
  const TestVolume ring(grid, centred(grid, glm::dvec3(0.12)), body(torus_distance, 0.3));
  const VolumeContent content = ring.content();
  const auto made = [&](const char* kind) {
    return make_renderer(kind, scene_of({&ring}), {&content, 1});
  };
  const auto iso = made("iso"), cast = made("cast"), blend = made("blend");
  const std::array others{made("slices"), made("cast-blend")};
  const RenderTarget target({128, 128});
  for (const auto& [near_mm, far_mm] :
       {std::pair{24.0, 26.5}, {26.0, 26.4}, {26.5, 40.0}, {28.5, 31.0}, {26.3, 26.6}}) {
    CAPTURE(near_mm);
    const View view = look_at({-29, -2, -6}, {}, near_mm, far_mm);
    const Agreement found =
        agreement(draw(*iso, view, target), draw(*cast, view, target), view, 0.12, 3);
    CHECK(found.compared > 500);
    CHECK(found.alike >= 0.98 * found.compared);
    const Drawn rays = draw(*blend, view, target);
    for (const auto& other : others) {
      CHECK(difference(rays, draw(*other, view, target)).mean < 0.25);
    }
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
  const RenderTarget target(kTestSize);
  for (const bool with_labels : {true, false}) {
    const VolumeContent content{
        volume.density, with_labels ? std::span<const Label>(labels) : std::span<const Label>()};
    const Agreement found =
        agreement(draw(*make_renderer("surface", scene, {&content, 1}), view, target),
                  draw(*make_renderer("iso", scene, {&content, 1}), view, target), view, 0.125, 8);
    CHECK(found.compared > 2000);
    CHECK(found.alike > 0.98 * found.compared);
    CHECK(found.near > 0.99 * found.compared);
  }
}

TEST_CASE("slices show what rays show, to 4/255 and a thousandth of a voxel in depth") {
  if (!have_gl()) return;
  const TestVolume volume = heap_of_balls();
  const VolumeContent content = volume.content();
  const RenderTarget target(kTestSize);
  const auto slices = make_renderer("slices", scene_of({&volume}), {&content, 1});
  const auto rays = make_renderer("blend", scene_of({&volume}), {&content, 1});
  for (const View& view : {look_at({14, 9, 20}, {}, 10, 40), look_at({-9, 9, 9}, {}, 5, 15),
                           look_at({0.1, 0.2, 0.3}, {5, 2, 1}, 0.5, 30)}) {  // the last from inside
    const Drawn a = draw(*slices, view, target);
    const Drawn b = draw(*rays, view, target);
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
  const glm::dvec3 left{-1.5, 0, 0}, right{1.5, 0, 0.4};
  const TestVolume a(grid, centred(grid, glm::dvec3(0.2), left), ball(left, 3, 0.4));
  const TestVolume b(grid, centred(grid, glm::dvec3(0.2), right), ball(right, 3, 0.4));
  const std::array<VolumeContent, 2> contents{a.content(), b.content()};
  const View view = look_at({3, 4, 29}, {}, 20, 40);
  const RenderTarget target(kTestSize);
  const auto drawn = [&](const char* kind) {
    return draw(*make_renderer(kind, scene_of({&a, &b}), contents), view, target);
  };
  const Difference off = difference(drawn("slices"), drawn("blend"));
  CHECK(off.mean < 0.5);
  CHECK(off.most < 24);
}

}  // namespace kerf::agreement_test
