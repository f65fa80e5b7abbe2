// SPDX-License-Identifier: Apache-2.0
// What is nearer is seen: volumes that go through one another, and tools among them, in every
// renderer against the analytic answer.
//
// For the opaque renderers the nearest surface gives colour and depth. For the translucent ones
// order means that the depth is where the first material on the ray begins, and that the colour is
// that of the nearer body where this one lets less than a tenth of the light through before the
// other begins. Left out is only where a voxel more or less decides (`clear_pixels`).
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>
#include <vector>

#include <doctest/doctest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "tests/visualizer/render/order_scene.hpp"
#include "visualizer/compose/picture_layers.hpp"
#include "visualizer/compose/tool_painter.hpp"

namespace kerf::order_test {

using namespace kerf::test;

namespace {

constexpr PictureSize kSize{128, 128};
constexpr double kMarginMm = TwoBodies::kShortestMm;
constexpr double kDepthMm = 0.5 * TwoBodies::kShortestMm;
constexpr double kHidden = 0.1;  // what a body lets through that hides what is behind

/// From all sides.
std::vector<View> views() {
  std::vector<View> all;
  for (const glm::dvec3& from :
       {glm::dvec3(2, 3, 30), glm::dvec3(-28, 6, 9), glm::dvec3(20, -14, 18),
        glm::dvec3(3, 28, -10), glm::dvec3(-6, -9, -28)}) {
    all.push_back(look_at(from, {0.4, 0, 0.2}, 15, 45));
  }
  return all;
}

/// The analytic answer in a view.
struct Truth {
  View view;
  std::vector<Nearest> nearest;
  std::vector<bool> clear;
};

std::vector<Truth> truths(const TwoBodies& two, const std::vector<double>& reach_mm) {
  std::vector<Truth> all;
  for (const View& view : views()) {
    auto nearest = nearest_bodies(two.bodies, reach_mm, view, kSize);
    auto clear = clear_pixels(nearest, kSize, kMarginMm);
    all.push_back({view, std::move(nearest), std::move(clear)});
  }
  return all;
}

/// What was compared with the answer, over all views.
struct Tally {
  int compared = 0;  ///< clear pixels with something in them
  int coloured = 0;  ///< of these, where the colour is decided too
  int left_out = 0;  ///< with something in them, near an edge or an intersection
  int wrong_depth = 0, wrong_colour = 0, wrong_air = 0;
  double worst_mm = 0.0;
};

bool alike(const Drawn& a, const Drawn& b, std::size_t at, int steps) {
  return std::equal(&a.rgb[3 * at], &a.rgb[3 * at] + 3, &b.rgb[3 * at],
                    [&](int x, int y) { return std::abs(x - y) <= steps; });
}

double depth_mm(const Drawn& drawn, std::size_t at, const View& view) {
  return eye_distance_mm(static_cast<double>(drawn.depth[at]), view);
}

void compare(const TwoBodies& two, bool translucent, const Drawn& drawn, const Truth& truth,
             Tally& tally) {
  const auto& [view, answer, clear] = truth;
  for (std::size_t at = 0; at < answer.size(); ++at) {
    const Nearest& nearest = answer[at];
    if (!clear[at]) {
      tally.left_out += nearest.body >= 0 ? 1 : 0;
      continue;
    }
    if (nearest.body < 0) {
      tally.wrong_air += drawn.depth[at] < 1.0F ? 1 : 0;
      continue;
    }
    ++tally.compared;
    const double off_mm = std::abs(depth_mm(drawn, at, view) - nearest.mm);
    tally.worst_mm = std::max(tally.worst_mm, off_mm);
    tally.wrong_depth += off_mm > kDepthMm ? 1 : 0;
    const auto body = static_cast<std::size_t>(nearest.body);
    const int x = static_cast<int>(at) % kSize.width;
    const int y = static_cast<int>(at) / kSize.width;
    if (translucent && two.transparency(body, pixel_ray(view, kSize, x, y), nearest.mm,
                                        nearest.next_mm) > kHidden) {
      continue;
    }
    ++tally.coloured;
    const std::uint8_t* const rgb = &drawn.rgb[3 * at];
    tally.wrong_colour += rgb[two.channel(body)] <= rgb[two.channel(1 - body)] ? 1 : 0;
  }
}

}  // namespace

TEST_CASE("of two volumes that intersect the nearer is seen, in every renderer and either order") {
  if (!have_gl()) return;
  const RenderTarget target(kSize);
  for (const bool swapped : {false, true}) {
    const TwoBodies two(swapped);
    const auto contents = two.contents();
    const std::vector<Truth> of_surfaces = truths(two, {two.reach_mm(false), two.reach_mm(false)});
    const std::vector<Truth> of_veils = truths(two, {two.reach_mm(true), two.reach_mm(true)});
    for (const std::string_view kind : renderer_kinds()) {
      const bool translucent = is_translucent(kind);
      const auto renderer = make_renderer(kind, two.scene, contents);
      REQUIRE(renderer->translucent() == translucent);
      Tally tally;
      for (const Truth& truth : translucent ? of_veils : of_surfaces) {
        compare(two, translucent, draw(*renderer, truth.view, target), truth, tally);
      }
      CAPTURE(std::string(kind));
      CAPTURE(swapped);
      CAPTURE(tally.worst_mm);
      CAPTURE(tally.compared);
      CAPTURE(tally.coloured);
      CAPTURE(tally.left_out);
      CHECK(tally.compared >= 10'000);
      CHECK(tally.coloured >= (translucent ? 0.5 : 1.0) * tally.compared);
      CHECK(tally.left_out < 0.25 * tally.compared);
      CHECK(tally.wrong_depth == 0);
      CHECK(tally.wrong_colour == 0);
      CHECK(tally.wrong_air == 0);
    }
  }
}

TEST_CASE(
    "a translucent volume over a surface: begun before it covers it, wholly behind it is not") {
  if (!have_gl()) return;
  const RenderTarget target(kSize);
  const TwoBodies two(false);
  const auto opaque = two.renderer_of("surface", 0);
  const std::vector<Truth> answers = truths(two, {0.0, two.reach_mm(true)});
  for (const std::string_view kind : {"blend", "slices", "cast-blend"}) {
    CAPTURE(std::string(kind));
    const auto veil = two.renderer_of(kind, 1);
    int before = 0, behind = 0, wrong = 0;
    for (const auto& [view, answer, clear] : answers) {
      const Drawn alone = draw(*opaque, view, target);
      veil->draw(view, target);
      const Drawn both{target.read_rgb(), target.read_depth()};
      for (std::size_t at = 0; at < answer.size(); ++at) {
        if (!clear[at] || answer[at].body < 0) continue;
        wrong += std::abs(depth_mm(both, at, view) - answer[at].mm) > kDepthMm ? 1 : 0;
        wrong += alike(both, alone, at, 0) != (answer[at].body == 0) ? 1 : 0;
        ++(answer[at].body == 0 ? behind : before);
      }
    }
    CHECK(before > 3'000);
    CHECK(behind > 3'000);
    CHECK(wrong == 0);
  }
}

TEST_CASE("volumes of different renderers intersect as their surfaces and veils do") {
  if (!have_gl()) return;
  const RenderTarget target(kSize);
  for (const auto& [first, second] : {std::pair{"surface", "blend"},
                                      {"cast-blend", "iso"},
                                      {"cast", "slices"},
                                      {"iso", "surface"},
                                      {"cast", "surface"}}) {
    const std::string choice = std::string(first) + "," + second;
    CAPTURE(choice);
    const TwoBodies two(false);
    ScenePainter painter(choice, two.scene, two.contents());
    const std::vector<double> reach_mm{two.reach_mm(is_translucent(first)),
                                       two.reach_mm(is_translucent(second))};
    int compared = 0, wrong_depth = 0, wrong_colour = 0;
    for (const auto& [view, answer, clear] : truths(two, reach_mm)) {
      target.bind();
      glClearColor(0.0F, 0.0F, 0.0F, 1.0F);
      glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
      painter.draw_volumes(ScenePainter::Layer::opaque, view, target);
      painter.draw_volumes(ScenePainter::Layer::translucent, view, target);
      const Drawn drawn{target.read_rgb(), target.read_depth()};
      for (std::size_t at = 0; at < answer.size(); ++at) {
        if (!clear[at] || answer[at].body < 0) continue;
        const auto body = static_cast<std::size_t>(answer[at].body);
        wrong_depth += std::abs(depth_mm(drawn, at, view) - answer[at].mm) > kDepthMm ? 1 : 0;
        ++compared;
        if (is_translucent(body == 0 ? first : second)) continue;  // the other may shine through
        const std::uint8_t* const rgb = &drawn.rgb[3 * at];
        wrong_colour += rgb[two.channel(body)] <= rgb[two.channel(1 - body)] ? 1 : 0;
      }
    }
    CHECK(compared > 10'000);
    CHECK(wrong_depth == 0);
    CHECK(wrong_colour == 0);
  }
}

TEST_CASE("a tool before, behind and inside volumes is seen as far as what is before it lets it") {
  if (!have_gl()) return;
  constexpr double kToolMm = 0.9;
  std::vector<ProfilePoint> half_circle;
  for (int i = 0; i <= 96; ++i) {
    const double angle = 3.14159265358979 * i / 96;
    half_circle.push_back({-kToolMm * std::cos(angle), kToolMm * std::sin(angle)});
  }
  const GpuMesh tool(lathe(half_circle));
  const Paint blue{.colour = {0.02, 0.02, 0.9}};
  MeshPainter painter;
  const RenderTarget target(kSize);
  const TwoBodies two(false);
  const View view = views().front();
  for (const std::string_view kind : renderer_kinds()) {
    CAPTURE(std::string(kind));
    const bool translucent = is_translucent(kind);
    const auto contents = two.contents();
    const auto renderer = make_renderer(kind, two.scene, contents);
    const double reach_mm = two.reach_mm(translucent);
    const Drawn without = draw(*renderer, view, target);
    int shown = 0, veiled = 0, covered = 0;
    // Out of the ball's front, in its skin, in its middle, behind it; and in the hole of the torus.
    for (const glm::dvec3& at_mm :
         {glm::dvec3(-1.2, 0.2, 4.6), glm::dvec3(-1.2, 0.2, 3.0), glm::dvec3(-1.6, 0.5, 2.25),
          glm::dvec3(-1.2, 0.2, 0.3), glm::dvec3(-2.4, 0.1, -3.4), glm::dvec3(1.9, -0.3, 0.2)}) {
      const glm::dmat4 pose = glm::translate(glm::dmat4(1.0), at_mm);
      target.bind();
      glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
      painter.draw(tool, pose, blue, view, target);
      const Drawn alone{target.read_rgb(), target.read_depth()};
      Drawn drawn;
      if (translucent) {
        renderer->draw(view, target);
        drawn = {target.read_rgb(), target.read_depth()};
      } else {
        static_cast<void>(draw(*renderer, view, target));
        painter.draw(tool, pose, blue, view, target);
        drawn = {target.read_rgb(), target.read_depth()};
      }
      std::vector<Distance> bodies = two.bodies;
      bodies.push_back(distance_to_ball(at_mm, kToolMm));
      const auto answer = nearest_bodies(bodies, {reach_mm, reach_mm, 0.0}, view, kSize);
      const auto clear = clear_pixels(answer, kSize, kMarginMm);
      int wrong = 0;
      for (std::size_t at = 0; at < answer.size(); ++at) {
        if (!clear[at] || answer[at].body < 0) continue;
        wrong += std::abs(depth_mm(drawn, at, view) - answer[at].mm) > kDepthMm ? 1 : 0;
        if (answer[at].body == 2) {
          wrong += alike(drawn, alone, at, 0) ? 0 : 1;
          ++shown;
          continue;
        }
        const int x = static_cast<int>(at) % kSize.width;
        const int y = static_cast<int>(at) / kSize.width;
        const PixelRay ray = pixel_ray(view, kSize, x, y);
        const auto tool_mm = first_hit_mm(ray, bodies.back(), 0.0, view.far_mm);
        if (!tool_mm) continue;
        const double lets_through =
            translucent ? two.transparency(static_cast<std::size_t>(answer[at].body), ray,
                                           answer[at].mm, *tool_mm)
                        : 0.0;
        const bool hidden = lets_through < 0.01;
        const bool seen = lets_through > 0.2 && answer[at].next_mm >= *tool_mm;
        constexpr int kRounding = 2;
        wrong += hidden && !alike(drawn, without, at, kRounding) ? 1 : 0;
        wrong += seen && alike(drawn, without, at, kRounding) ? 1 : 0;
        covered += hidden ? 1 : 0;
        veiled += seen ? 1 : 0;
      }
      CAPTURE(at_mm.z);
      CHECK(wrong == 0);
    }
    CHECK(shown > 200);
    CHECK(covered > 200);
    CHECK((veiled > 50) == translucent);
  }
}

}  // namespace kerf::order_test
