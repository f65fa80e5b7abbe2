// SPDX-License-Identifier: Apache-2.0
// Volumes, tool and arrow in one depth buffer.
#include <array>
#include <cmath>

#include <doctest/doctest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "tests/visualizer/gl/gl_fixture.hpp"
#include "visualizer/compose/tool_painter.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

constexpr PictureSize kSize{96, 96};

std::size_t pixel(int x, int y) {
  return static_cast<std::size_t>(y * kSize.width + x);
}

}  // namespace

TEST_CASE("of two intersecting volumes the nearer surface is seen, whatever their order") {
  if (!have_gl()) return;
  const VoxelGrid grid{40, 40, 40};
  const glm::dvec3 left{-1.5, 0, 0};
  const glm::dvec3 right{1.5, 0, 0.4};
  const TestVolume a(grid, centred(grid, glm::dvec3(0.2), left), ball(left, 3.0, 0.4));
  const TestVolume b(grid, centred(grid, glm::dvec3(0.2), right), ball(right, 3.0, 0.4));
  const View view = look_at({0, 0, 30}, {}, 20, 40);
  const RenderTarget target(kSize);
  const auto picture = [&](const TestVolume& first, const TestVolume& second) {
    SceneView scene;
    scene.volumes = {first.view, second.view};
    const std::array<VolumeContent, 2> contents{first.content(), second.content()};
    IsoRenderer renderer(scene, contents);
    return draw(renderer, view, target);
  };
  const Drawn ab = picture(a, b);
  const Drawn ba = picture(b, a);
  CHECK(ab.depth == ba.depth);
  int compared = 0;
  double worst_mm = 0.0;
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      const PixelRay ray = pixel_ray(view, kSize, x, y);
      double nearest_mm = 1e9;
      for (const glm::dvec3& centre : {left, right}) {
        const glm::dvec3 from = ray.origin_mm - centre;
        const double aa = glm::dot(ray.direction, ray.direction);
        const double bb = glm::dot(from, ray.direction);
        const double root = bb * bb - aa * (glm::dot(from, from) - 9.0);
        // Not at the rims: there a tenth of a voxel decides.
        if (root > 0.15 * aa * 9.0)
          nearest_mm = std::min(nearest_mm, (-bb - std::sqrt(root)) / aa);
        else if (root > -0.1 * aa * 9.0)
          nearest_mm = -1e9;
      }
      if (std::abs(nearest_mm) > 1e8) continue;
      const double seen_mm = eye_distance_mm(static_cast<double>(ab.depth[pixel(x, y)]), view);
      worst_mm = std::max(worst_mm, std::abs(seen_mm - nearest_mm));
      ++compared;
    }
  }
  CHECK(compared > 1000);
  CHECK(worst_mm < 0.1);
}

TEST_CASE(
    "a tool is hidden behind the volume, visible before it, and cuts into it where it enters") {
  if (!have_gl()) return;
  const VoxelGrid grid{40, 40, 40};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.2)), ball({}, 3.0, 0.4));
  SceneView scene;
  scene.volumes = {volume.view};
  const VolumeContent content = volume.content();
  IsoRenderer renderer(scene, {&content, 1});
  MeshPainter painter;
  std::vector<ProfilePoint> half_circle;
  for (int i = 0; i <= 32; ++i) {
    const double angle = 3.14159265358979 * i / 32;
    half_circle.push_back({-std::cos(angle), std::sin(angle)});
  }
  const GpuMesh tool(lathe(half_circle));  // a ball of 1 mm
  const View view = look_at({0, 0, 30}, {}, 20, 40);
  const RenderTarget target(kSize);
  const Drawn alone = draw(renderer, view, target);
  const auto with_tool_at = [&](glm::dvec3 at) {
    static_cast<void>(draw(renderer, view, target));
    painter.draw(tool, glm::translate(glm::dmat4(1.0), at), {}, view, target);
    return Drawn{target.read_rgb(), target.read_depth()};
  };
  const std::size_t middle = pixel(kSize.width / 2, kSize.height / 2);

  const Drawn behind = with_tool_at({0, 0, -5});
  CHECK(behind.rgb == alone.rgb);
  CHECK(behind.depth == alone.depth);

  const Drawn before = with_tool_at({0, 0, 5});
  CHECK(eye_distance_mm(static_cast<double>(before.depth[middle]), view) ==
        doctest::Approx(24.0).epsilon(0.001));

  // Sunk so deep that its front is half a millimetre out.
  const Drawn sunk = with_tool_at({0, 0, 2.5});
  CHECK(eye_distance_mm(static_cast<double>(sunk.depth[middle]), view) ==
        doctest::Approx(26.5).epsilon(0.001));
  int changed = 0;
  for (std::size_t i = 0; i < sunk.depth.size(); ++i)
    changed += sunk.depth[i] != alone.depth[i] ? 1 : 0;
  int whole = 0;
  for (std::size_t i = 0; i < before.depth.size(); ++i)
    whole += before.depth[i] != alone.depth[i] ? 1 : 0;
  CHECK(changed > 0);
  CHECK(changed < whole);  // only the cap that stands out of the volume
}

TEST_CASE("the part of the force arrow inside the volume shines through and leaves depth alone") {
  if (!have_gl()) return;
  const VoxelGrid grid{40, 40, 40};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.2)), ball({}, 3.0, 0.4));
  SceneView scene;
  scene.volumes = {volume.view};
  const VolumeContent content = volume.content();
  IsoRenderer renderer(scene, {&content, 1});
  MeshPainter painter;
  const View view = look_at({0, 0, 30}, {}, 20, 40);
  const RenderTarget target(kSize);
  const Drawn alone = draw(renderer, view, target);
  painter.draw_arrow({0, -2, 0}, {0, 2, 0}, 0.2, {}, view, target);
  CHECK(target.read_depth() == alone.depth);
  CHECK(target.read_rgb() != alone.rgb);
  static_cast<void>(draw(renderer, view, target));
  painter.draw_arrow({0, 0, 0}, {0, 0, 0}, 0.2, {}, view, target);  // no force, no arrow
  CHECK(target.read_rgb() == alone.rgb);
}
