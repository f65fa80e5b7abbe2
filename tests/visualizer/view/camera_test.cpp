// SPDX-License-Identifier: Apache-2.0
#include "visualizer/scene/camera.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "tests/support/temporary_folder.hpp"
#include "tests/visualizer/gl/gl_fixture.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/scene/camera_pose.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf::camera_test {

using namespace kerf::test;

namespace {

BoxCorners box(glm::dvec3 lo, glm::dvec3 hi) {
  BoxCorners corners;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    corners[i] = {(i & 1) != 0 ? hi.x : lo.x, (i & 2) != 0 ? hi.y : lo.y,
                  (i & 4) != 0 ? hi.z : lo.z};
  }
  return corners;
}

glm::dvec3 ndc(const View& view, glm::dvec3 world_mm) {
  const glm::dvec4 clip = view.clip_from_eye() * view.eye_from_world * glm::dvec4(world_mm, 1.0);
  return glm::dvec3(clip) / clip.w;
}

}  // namespace

TEST_CASE("equation (1) is the depth of the projection matrix at every distance") {
  CHECK(rc::check([] {
    View view;
    view.near_mm = *rc::gen::inRange(1, 10'000) * 1e-3;
    view.far_mm = view.near_mm * (1.0 + *rc::gen::inRange(1, 10'000) * 1e-2);
    const double fraction = *rc::gen::inRange(0, 1001) * 1e-3;
    const double eye_mm = view.near_mm + fraction * (view.far_mm - view.near_mm);
    const glm::dvec4 clip = view.clip_from_eye() * glm::dvec4(0.3, -0.2, -eye_mm, 1.0);
    const double depth = window_depth(eye_mm, view.near_mm, view.far_mm);
    RC_ASSERT(std::abs(depth - 0.5 * (clip.z / clip.w + 1.0)) < 1e-9);
  }));
  CHECK(window_depth(2.0, 2.0, 50.0) == doctest::Approx(0.0));
  CHECK(window_depth(50.0, 2.0, 50.0) == doctest::Approx(1.0));
}

TEST_CASE("a framed box lies between near and far with its middle in the middle of the picture") {
  CHECK(rc::check([] {
    const auto mm = [](int from) { return rc::gen::inRange(from, 400); };
    const glm::dvec3 lo{*mm(-400), *mm(-400), *mm(-400)};
    const glm::dvec3 hi = lo + glm::dvec3{*mm(1), *mm(1), *mm(1)};
    const double aspect = *rc::gen::inRange(2, 40) * 0.1;
    OrbitCamera camera;
    camera.frame(box(lo, hi), aspect);
    const View view = camera.view(aspect, 0.5 * glm::length(hi - lo));
    for (const glm::dvec3& corner : box(lo, hi)) {
      const glm::dvec3 at = ndc(view, corner);
      RC_ASSERT(std::abs(at.z) <= 1.0 + 1e-9);
      RC_ASSERT(std::max(std::abs(at.x), std::abs(at.y)) < 1.4);
    }
    const glm::dvec3 middle = ndc(view, 0.5 * (lo + hi));
    RC_ASSERT(std::hypot(middle.x, middle.y) < 1e-9);
  }));
}

TEST_CASE("of two boxes far apart both are framed, as one box around both would be") {
  const BoxCorners left = box({-30, -2, -2}, {-25, 3, 2});
  const BoxCorners right = box({20, -1, -4}, {26, 4, 1});
  std::vector<glm::dvec3> both(left.begin(), left.end());
  both.insert(both.end(), right.begin(), right.end());
  OrbitCamera camera;
  camera.frame(both, 1.5);
  CHECK(camera.radius_mm() == doctest::Approx(glm::length(glm::dvec3(28, 3, 3))).epsilon(0.05));
  const View view = camera.view(1.5, camera.radius_mm());
  double widest = 0.0;
  for (const glm::dvec3& corner : both) widest = std::max(widest, std::abs(ndc(view, corner).x));
  CHECK(widest > 0.8);
  CHECK(widest < 1.2);
}

TEST_CASE("whatever the user drags, the view stays a rigid one with near before far") {
  CHECK(rc::check([](const std::vector<std::array<int, 3>>& drags) {
    OrbitCamera camera;
    camera.frame(box({-5, -5, -5}, {5, 9, 5}), 1.5);
    for (const auto& [kind, a, b] : drags) {
      const double x = (a % 4000) * 1e-2;
      const double y = (b % 4000) * 1e-2;
      if (kind % 3 == 0) camera.orbit(x, y);
      if (kind % 3 == 1) camera.pan(x, y);
      if (kind % 3 == 2) camera.zoom(x);
    }
    const View view = camera.view(1.5, 20.0);
    const glm::dmat3 turn(view.eye_from_world);
    RC_ASSERT(std::abs(glm::determinant(turn) - 1.0) < 1e-9);
    RC_ASSERT(view.near_mm > 0.0);
    RC_ASSERT(view.far_mm > view.near_mm);
  }));
}

TEST_CASE("dragging to the right moves what is in the middle to the right") {
  OrbitCamera camera;
  camera.frame(box({-5, -5, -5}, {5, 5, 5}), 1.0);
  camera.pan(0.1, 0.0);
  CHECK(ndc(camera.view(1.0, 9.0), {0, 0, 0}).x == doctest::Approx(0.2));  // of half the height
  camera.frame(box({-5, -5, -5}, {5, 5, 5}), 1.0);
  camera.orbit(0.05, 0.0);
  const View view = camera.view(1.0, 9.0);
  const glm::dvec3 towards_eye(glm::transpose(glm::dmat3(view.eye_from_world)) *
                               glm::dvec3(0, 0, 3));
  OrbitCamera still;
  still.frame(box({-5, -5, -5}, {5, 5, 5}), 1.0);
  const View before = still.view(1.0, 9.0);
  const glm::dvec3 front(glm::transpose(glm::dmat3(before.eye_from_world)) * glm::dvec3(0, 0, 3));
  CHECK(ndc(view, front).x > 0.0);  // the point that was in front has gone right
  CHECK(ndc(view, towards_eye).x == doctest::Approx(0.0));
}

TEST_CASE("a pose is looked at from its eye: the target in the middle, up upright, at any roll") {
  CHECK(rc::check([] {
    const auto mm = [] { return *rc::gen::inRange(-900, 900) * 0.1; };
    CameraPose pose{{mm(), mm(), mm()}, {mm(), mm(), mm()}, {mm(), mm(), mm()}};
    if (*rc::gen::inRange(0, 3) == 0) pose.target_mm = pose.eye_mm - glm::dvec3(0.0, 7.0, 0.0);
    RC_PRE(problem_with(pose).empty());
    OrbitCamera camera;
    camera.frame(box({-5, -5, -5}, {5, 9, 5}), 1.5);
    camera.look(pose);
    const View view = camera.view(1.5, 20.0);
    // By the columns of a matrix that looks from one point to another, not by angles.
    const glm::dvec3 forward = glm::normalize(pose.target_mm - pose.eye_mm);
    const glm::dvec3 right = glm::normalize(glm::cross(forward, pose.up));
    for (const glm::dvec3& at : {glm::dvec3(3, -8, 4), pose.target_mm, pose.eye_mm}) {
      const glm::dvec3 from_eye = at - pose.eye_mm;
      const glm::dvec3 wanted(glm::dot(right, from_eye),
                              glm::dot(glm::cross(right, forward), from_eye),
                              -glm::dot(forward, from_eye));
      const glm::dvec3 seen(view.eye_from_world * glm::dvec4(at, 1.0));
      RC_ASSERT(glm::length(seen - wanted) < 1e-6);
    }
    RC_ASSERT(view.near_mm > 0.0);
    RC_ASSERT(view.far_mm > view.near_mm);
    const CameraPose back = camera.pose();
    RC_ASSERT(glm::length(back.eye_mm - pose.eye_mm) < 1e-6);
    RC_ASSERT(glm::length(back.target_mm - pose.target_mm) < 1e-6);
    RC_ASSERT(std::abs(glm::dot(back.up, right)) < 1e-9);
  }));
}

TEST_CASE("a rolled picture follows a drag, and a wheel turns no camera far off round to near") {
  OrbitCamera camera;
  camera.frame(box({-5, -5, -5}, {5, 5, 5}), 1.0);
  camera.look({{0, 0, 40}, {0, 0, 0}, {1, 0, 0}});  // lies on its side: +x is up
  camera.orbit(0.05, 0.0);
  CHECK(ndc(camera.view(1.0, 9.0), {0, 0, 3}).x > 0.01);  // what was in front went right
  CHECK(ndc(camera.view(1.0, 9.0), {0, 0, 3}).y == doctest::Approx(0.0));
  camera.look({{0, 0, 5000}, {0, 0, 0}, {0, 1, 0}});
  camera.zoom(-3.0);
  CHECK(camera.distance_mm() == doctest::Approx(5000.0));
  camera.zoom(1.0);
  CHECK(camera.distance_mm() == doctest::Approx(4500.0));
}

TEST_CASE("a camera is nine numbers or a file, and each mistake is one line") {
  const CameraPose pose{{12.5, -40, 33}, {0, 1e-3, 0}, {0, 0, -2}};
  CHECK(read_camera("12.5,-40,33,0,1e-3,0,0,0,-2") == pose);
  CHECK(parse_camera("[camera]\neye_mm = [12.5, -40, 33]\nup = [0, 0, -2]\n"
                     "target_mm = [0, 0.001, 0]\n",
                     "c") == pose);
  const TemporaryFolder folder;
  write_camera(folder / "a,b.toml", pose);
  CHECK(read_camera((folder / "a,b.toml").string()) == pose);

  const auto numbers = [](const char* text, const char* wanted) {
    CAPTURE(text);
    try {
      static_cast<void>(read_camera(text));
      FAIL("is taken");
    } catch (const VisualizerError& problem) {
      const std::string line = problem.what();
      CHECK(line.starts_with(wanted));
      CHECK(line.find('\n') == line.npos);
    }
  };
  numbers("1,2,3", "--camera: 3 numbers");
  numbers("1,2,3,4,5,6,7,8,9,10", "--camera: 10 numbers");
  numbers("1,2,3,4,5,6,7,8,", "--camera: '' is no number");
  numbers("1,2,3,4,5,6,7,8,up\n", "--camera: 'up\\n' is no number");
  numbers("nan,2,3,4,5,6,7,8,9", "--camera: 'nan' is no number");
  numbers("1,2,3,4,5,6,7,8,inf", "--camera: 'inf' is no number");
  numbers("1,2,3,1,2,3,0,1,0", "--camera: EYE and TARGET are both at 1,2,3; ");
  numbers("1,2,3,1,2,4,0,0,0", "--camera: UP 0,0,0 has no direction; give one, such as 0,1,0");
  numbers("0,9,0,0,0,0,0,-1,0",
          "--camera: UP 0,-1,0 is along the view; give another direction, such as 0,0,1");
  numbers("1,2,3,2,4,6,0.333333,0.666667,1",
          "--camera: UP 0.333333,0.666667,1 is along the view; give another direction, such as "
          "1,0,0");
  numbers("1e6,2,3,4,5,6,7,8,9", "--camera: EYE 1e+06,2,3 is beyond 1e+05 mm; ");

  const auto file = [](const char* text, const char* wanted) {
    CAPTURE(text);
    CHECK_THROWS_WITH_AS(static_cast<void>(parse_camera(text, "c")), doctest::Contains(wanted),
                         VisualizerError);
  };
  file("", "c: there is no table [camera]; write one");
  file("[opacity]\nbone = 1\n", "c:1: opacity is not known here; known is the table [camera]");
  file("[camera]\nfov = 3\n",
       "c:2: camera.fov is not known here; known are eye_mm, target_mm and up");
  file("[camera]\neye_mm = [1, 2]\n",
       "c:2: camera.eye_mm = [1, 2] is not three numbers; give [x, y, z]");
  file("[camera]\neye_mm = 1\n", "c:2: camera.eye_mm = 1 is not three numbers; give [x, y, z]");
  file("[camera]\neye_mm = [1, 2, 'z']\n",
       "c:2: camera.eye_mm = [1, 2, \"z\"] is not three numbers; give [x, y, z]");
  file("\n[camera]\neye_mm = [1, 2, 3]\nup = [0, 1, 0]\n", "c:2: camera has no target_mm; ");
  file("[camera]\neye_mm = [nan, 2, 3]\ntarget_mm = [0, 0, 0]\nup = [0, 1, 0]\n",
       "c:1: EYE nan,2,3 is beyond 1e+05 mm; ");
  file("[camera]\neye_mm = [1, 2, 3]\ntarget_mm = [1, 2, 3]\nup = [0, 1, 0]\n",
       "c:1: EYE and TARGET are both at 1,2,3; ");
  CHECK_THROWS_WITH_AS(static_cast<void>(read_camera("nowhere.toml")),
                       doctest::Contains("nowhere.toml: no such file; name a camera, "),
                       VisualizerError);
}

TEST_CASE("whatever a camera's file holds, it gives a camera that can be looked from or one line") {
  CHECK(rc::check([](const std::string& text) {
    for (const std::string& whole : {text, "[camera]\nup = [" + text}) {
      try {
        RC_ASSERT(problem_with(parse_camera(whole, "c")).empty());
      } catch (const VisualizerError& problem) {
        RC_ASSERT(std::string_view(problem.what()).find('\n') == std::string_view::npos);
      }
    }
  }));
}

namespace {

/// Half widths and half heights of the picture from its middle.
glm::dvec2 seen_at(const View& view, glm::dvec3 world_mm) {
  const glm::dvec4 clip = view.clip_from_eye() * view.eye_from_world * glm::dvec4(world_mm, 1.0);
  return glm::dvec2(clip) / clip.w;
}

/// The middle column of what is drawn, in half widths from the picture's middle.
double middle_of(const Drawn& drawn, PictureSize size) {
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < drawn.depth.size(); ++i) {
    if (drawn.depth[i] >= 1.0F) continue;
    sum += static_cast<double>(i % static_cast<std::size_t>(size.width)) + 0.5;
    count += 1.0;
  }
  REQUIRE(count > 50.0);
  return sum / count / size.width * 2.0 - 1.0;
}

}  // namespace

TEST_CASE("disparity is that of the formula: none at the convergence distance, none up or down") {
  CHECK(rc::check([] {
    const auto real = [](int lo, int hi) { return *rc::gen::inRange(lo, hi) * 1e-3; };
    View middle = look_at({3.0, 4.0, 60.0}, {1.0, 0.0, 0.0}, 1.0, 500.0);
    middle.aspect = real(300, 3000);
    const StereoBase base{real(-9000, 9000), real(1000, 200'000)};
    const auto [left, right] = eye_views(middle, base);
    const double z = real(1000, 200'000);
    const glm::dvec3 in_eye{real(-20'000, 20'000), real(-20'000, 20'000), -z};
    const glm::dvec3 world(glm::inverse(middle.eye_from_world) * glm::dvec4(in_eye, 1.0));
    const glm::dvec2 between = seen_at(left, world) - seen_at(right, world);
    const double half_width = middle.tan_half_height * middle.aspect;
    const double expected = base.eyes_mm * (1.0 / z - 1.0 / base.convergence_mm) / half_width;
    RC_ASSERT(std::abs(between.x - expected) < 1e-9);
    RC_ASSERT(std::abs(between.y) < 1e-12);
  }));
}

TEST_CASE("every renderer draws both eyes where the formula says") {
  if (!have_gl()) return;
  const VoxelGrid grid{40, 40, 40};
  const PictureSize size{160, 120};
  const RenderTarget target(size);
  View middle = look_at({0, 0, 30}, {}, 5.0, 80.0);
  middle.aspect = 4.0 / 3.0;
  for (const double z_mm : {30.0, 24.0, 40.0}) {
    const TestVolume volume(grid, centred(grid, glm::dvec3(0.1), {0.5, 0.3, 30.0 - z_mm}),
                            ball({0.5, 0.3, 30.0 - z_mm}, 1.4, 0.3));
    const VolumeContent content = volume.content();
    SceneView scene;
    scene.volumes.push_back(volume.view);
    const StereoBase base{2.0, 30.0};
    const auto [left, right] = eye_views(middle, base);
    for (const std::string_view kind : renderer_kinds()) {
      CAPTURE(std::string(kind));
      CAPTURE(z_mm);
      const auto renderer = make_renderer(kind, scene, {&content, 1});
      const double between = middle_of(draw(*renderer, left, target), size) -
                             middle_of(draw(*renderer, right, target), size);
      const double expected = base.eyes_mm * (1.0 / z_mm - 1.0 / base.convergence_mm) /
                              (middle.tan_half_height * middle.aspect);
      constexpr double kPixel = 2.0 / 160.0;
      CHECK(between == doctest::Approx(expected).scale(1.0).epsilon(0.3 * kPixel));
    }
  }
}

}  // namespace kerf::camera_test
