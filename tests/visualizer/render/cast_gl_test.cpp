// SPDX-License-Identifier: Apache-2.0
// The ray caster's pictures through GL: beside the shader's, and together with other things.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include <doctest/doctest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "tests/visualizer/gl/gl_fixture.hpp"
#include "tests/visualizer/render/exact_body.hpp"
#include "tests/visualizer/render/renderer_fixture.hpp"
#include "tests/visualizer/render/teeth.hpp"
#include "visualizer/compose/tool_painter.hpp"
#include "visualizer/render/cast_renderer.hpp"
#include "visualizer/render/translucent_renderers.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

constexpr PictureSize kSize{320, 320};
constexpr VoxelGrid kSmall{128, 128, 80};

const std::array<View, 3> kViews{look_at({18, 22, 30}, {}, 20, 60), look_at({0, 40, 1}, {}, 20, 60),
                                 look_at({-25, -8, 12}, {0, 2, 0}, 10, 60)};

struct Agreement {
  int compared = 0;  ///< pixels that either one drew
  int alike = 0;
};

Agreement agreement(const Drawn& a, const Drawn& b, const View& view, double voxel_mm) {
  Agreement found;
  for (std::size_t i = 0; i < a.depth.size(); ++i) {
    if (a.depth[i] >= 1.0F && b.depth[i] >= 1.0F) continue;
    ++found.compared;
    if (a.depth[i] >= 1.0F || b.depth[i] >= 1.0F) continue;
    int worst = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      worst = std::max(worst, std::abs(a.rgb[3 * i + c] - b.rgb[3 * i + c]));
    }
    const double apart_mm = eye_distance_mm(static_cast<double>(a.depth[i]), view) -
                            eye_distance_mm(static_cast<double>(b.depth[i]), view);
    found.alike += worst <= 3 && std::abs(apart_mm) <= 0.5 * voxel_mm ? 1 : 0;
  }
  return found;
}

std::size_t pixel(int x, int y) {
  return static_cast<std::size_t>(y * kSize.width + x);
}

}  // namespace

TEST_CASE("iso and cast draw teeth alike, by labels and by density, also after a cut") {
  if (!have_gl()) return;
  const RenderTarget target(kSize);
  std::vector<Tooth> teeth{phantom(kSmall, true), phantom(kSmall, false)};
  if (auto tooth = ct_tooth()) teeth.push_back(std::move(*tooth));
  for (Tooth& tooth : teeth) {
    const VolumeContent content = tooth.content();
    IsoRenderer iso(tooth.scene, {&content, 1});
    CastRenderer cast(tooth.scene, {&content, 1}, CastMode::iso);
    for (const bool drilled : {false, true}) {
      if (drilled) {
        const auto changed = tooth.drill();
        iso.update(0, tooth.image.density, changed);
        cast.update(0, tooth.image.density, changed);
      }
      for (const View& view : kViews) {
        const Drawn shader = draw(iso, view, target);
        const Drawn own = draw(cast, view, target);
        const Agreement found = agreement(shader, own, view, tooth.image.spacing_mm[0]);
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
  SceneView scene;
  scene.volumes = {ring.view};
  const VolumeContent content = ring.content();
  IsoRenderer iso(scene, {&content, 1});
  CastRenderer cast(scene, {&content, 1}, CastMode::iso);
  BlendRenderer blend(scene, {&content, 1});
  SlicesRenderer slices(scene, {&content, 1});
  CastRenderer cast_blend(scene, {&content, 1}, CastMode::blend);
  const RenderTarget target({128, 128});
  for (const auto& [near_mm, far_mm] :
       {std::pair{24.0, 26.5}, {26.0, 26.4}, {26.5, 40.0}, {28.5, 31.0}, {26.3, 26.6}}) {
    CAPTURE(near_mm);
    const View view = look_at({-29, -2, -6}, {}, near_mm, far_mm);
    const Drawn shader = draw(iso, view, target);
    const Agreement found = agreement(shader, draw(cast, view, target), view, 0.12);
    CHECK(found.compared > 500);
    CHECK(found.alike >= 0.98 * found.compared);
    const Drawn rays = draw(blend, view, target);
    for (Renderer* const other : std::initializer_list<Renderer*>{&slices, &cast_blend}) {
      CHECK(difference(rays, draw(*other, view, target)).mean < 0.25);
    }
  }
}

TEST_CASE(
    "within a part of the target only its pixels are drawn, and they are those of the whole") {
  if (!have_gl()) return;
  const Tooth tooth = phantom(kSmall, true);
  const VolumeContent content = tooth.content();
  RenderTarget target(kSize);
  for (const CastMode mode : {CastMode::iso, CastMode::blend}) {
    CastRenderer cast(tooth.scene, {&content, 1}, mode);
    const Drawn whole = draw(cast, kViews[0], target);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    const std::vector<float> empty = target.read_depth();
    target.restrict_to({100, 90, 175, 141});
    cast.draw(kViews[0], target);
    target.restrict_to(target.all());
    const std::vector<float> depth = target.read_depth();
    const std::vector<std::uint8_t> rgb = target.read_rgb();
    std::size_t wrong = 0;
    for (int y = 0; y < kSize.height; ++y) {
      for (int x = 0; x < kSize.width; ++x) {
        const int from_below = kSize.height - 1 - y;
        const bool in = x >= 100 && x < 175 && from_below >= 90 && from_below < 141;
        const std::size_t at = pixel(x, y);
        wrong += depth[at] != (in ? whole.depth[at] : empty[at]) ? 1 : 0;
        wrong += rgb[3 * at] != (in ? whole.rgb[3 * at] : 0) ? 1 : 0;
      }
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("a tool hides, is hidden and shines through as its place says") {
  if (!have_gl()) return;
  const VoxelGrid grid{40, 40, 40};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), ball({}, 3.0, 1.0));
  SceneView scene;
  scene.volumes = {volume.view};
  const VolumeContent content = volume.content();
  const std::array<ProfilePoint, 4> cylinder{{{-1.0, 0.0}, {-1.0, 1.0}, {1.0, 1.0}, {1.0, 0.0}}};
  const GpuMesh tool(lathe(cylinder));
  MeshPainter painter;
  const View view = look_at({0, 0, 30}, {}, 20, 40);
  const RenderTarget target(kSize);
  const std::size_t middle = pixel(kSize.width / 2, kSize.height / 2);
  const auto with_tool_at = [&](CastMode mode, double z_mm) {
    CastRenderer cast(scene, {&content, 1}, mode);
    target.bind();
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    painter.draw(tool, glm::translate(glm::dmat4(1.0), {0, 0, z_mm}), {}, view, target);
    const std::uint8_t tool_red = target.read_rgb()[3 * middle];
    cast.draw(view, target);
    return std::pair(target.read_rgb()[3 * middle] == tool_red,
                     eye_distance_mm(static_cast<double>(target.read_depth()[middle]), view));
  };
  for (const CastMode mode : {CastMode::iso, CastMode::blend}) {
    const auto [shown, before_mm] = with_tool_at(mode, 6.0);
    CHECK(shown);
    CHECK(before_mm == doctest::Approx(23.0).epsilon(0.001));
    const auto [seen_behind, behind_mm] = with_tool_at(mode, -6.0);
    CHECK_FALSE(seen_behind);
    CHECK(std::abs(behind_mm - 27.0) < 0.8);
  }
  // Its front is 0.2 mm below the surface of the ball: iso covers it, blend veils it.
  const auto [covered, iso_mm] = with_tool_at(CastMode::iso, 1.8);
  CHECK_FALSE(covered);
  CHECK(iso_mm == doctest::Approx(27.0).epsilon(0.001));
  const auto [clear, blend_mm] = with_tool_at(CastMode::blend, 1.8);
  CHECK_FALSE(clear);
  CHECK(blend_mm <= doctest::Approx(27.2).epsilon(0.001));
}
