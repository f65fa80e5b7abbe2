// SPDX-License-Identifier: Apache-2.0
// The pointer, keys, sticks and a SpaceMouse lead the hand.
#include "visualizer/app/hand_control.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

namespace kerf::hand_control_test {
namespace {

constexpr PictureSize kPixels{400, 300};
constexpr double kFrameS = 0.02;

struct Bench {
  OrbitCamera camera;
  PointerHand hand;
  DeviceFrame device{{1.0, 2.0, 3.0}, 2.0};
  glm::dvec3 tool_mm{0.5, -0.5, 1.0};

  Bench() { camera.frame(box_corners(glm::dvec3(-5.0), glm::dvec3(5.0)), 4.0 / 3.0); }
  [[nodiscard]] View view() const { return camera.view(4.0 / 3.0, 40.0); }
  [[nodiscard]] SeenPoint goal() const { return seen_at(view(), kPixels, *hand.goal_mm()); }
  [[nodiscard]] SeenPoint tool() const { return seen_at(view(), kPixels, tool_mm); }
  void frame(const WindowInput& input, bool over_panel = false) {
    hand.step(input, over_panel, view(), kPixels, tool_mm, device, kFrameS);
  }
};

WindowInput at(double x, double y) {
  WindowInput input;
  input.hovers = true;
  input.free_up = 1e-12;  // it moves
  input.pointer = {x, y, false};
  return input;
}

bool near(const glm::dvec2& a, const glm::dvec2& b) {
  return glm::length(a - b) < 1e-6;
}

}  // namespace

TEST_CASE("a point of the world is seen where it is drawn, and found again there") {
  const Bench bench;
  const View view = bench.view();
  for (const glm::dvec3& point : {glm::dvec3(0.0), glm::dvec3(3.0, -2.0, 1.0)}) {
    const SeenPoint seen = seen_at(view, kPixels, point);
    glm::dvec4 clip = view.clip_from_eye() * view.eye_from_world * glm::dvec4(point, 1.0);
    clip /= clip.w;
    CHECK(near(seen.pixel, {(clip.x + 1.0) * 200.0, (1.0 - clip.y) * 150.0}));
    CHECK(glm::length(world_at(view, kPixels, seen) - point) < 1e-9);
  }
}

TEST_CASE("nobody leads before the pointer moves; then the goal is under it, at the tool's depth") {
  Bench bench;
  bench.frame({});
  CHECK_FALSE(bench.hand.leads());
  WindowInput rests = at(120, 80);
  rests.free_up = 0.0;
  bench.frame(rests);
  CHECK_FALSE(bench.hand.leads());
  CHECK_FALSE(bench.hand.goal_mm());
  bench.frame(at(120, 80));
  CHECK(bench.hand.leads());
  CHECK(near(bench.goal().pixel, {120, 80}));
  CHECK(bench.goal().depth_mm == doctest::Approx(bench.tool().depth_mm));
  const HandTarget target = bench.hand.target(bench.device);
  const glm::dvec3 goal = *bench.hand.goal_mm();
  CHECK(target.tip_mm.x == doctest::Approx((goal.x - 1.0) / 2.0));
  CHECK(target.tip_mm.z == doctest::Approx((goal.z - 3.0) / 2.0));
}

TEST_CASE("a pointer that jumps into the window leads at once") {
  Bench bench;
  WindowInput jumped = at(120, 80);
  jumped.free_up = 0.0;
  jumped.came = true;
  bench.frame(jumped, true);  // onto a panel
  CHECK_FALSE(bench.hand.leads());
  bench.frame(jumped);
  CHECK(bench.hand.leads());
  CHECK(near(bench.goal().pixel, {120, 80}));
}

TEST_CASE("who turns the wheel or presses before the pointer moved leads too") {
  for (const int use : {0, 1, 2}) {
    CAPTURE(use);
    Bench bench;
    WindowInput first = at(120, 80);
    first.free_up = 0.0;
    if (use == 0) first.wheel = 2.0;
    if (use == 1) first.pointer.down = true;
    if (use == 2) first.held.deeper = 1.0;
    bench.frame(first);
    CHECK(bench.hand.leads());
    CHECK(near(bench.goal().pixel, {120, 80}));
    CHECK(bench.goal().depth_mm > bench.tool().depth_mm);
  }
}

TEST_CASE("it moves with the pointer, and goes deeper by the wheel under it") {
  Bench bench;
  bench.frame(at(120, 80));
  WindowInput moved = at(150, 95);
  moved.free_right = 0.1;  // 30 of 300 pixels
  moved.free_up = -0.05;
  moved.wheel = 4;
  bench.frame(moved);
  CHECK(near(bench.goal().pixel, {150, 95}));
  const double deeper_mm = 4 * PointerHand::kWheelMm * 2.0;  // the scene's scale
  CHECK(bench.goal().depth_mm == doctest::Approx(bench.tool().depth_mm + deeper_mm));
  moved = at(150, 95);
  moved.wheel = 1e6;  // no further than one would wind back
  bench.frame(moved);
  CHECK(bench.goal().depth_mm ==
        doctest::Approx(bench.tool().depth_mm + PointerHand::kMostAheadMm * 2.0));
  moved.wheel = -1e6;
  bench.frame(moved);
  CHECK(bench.goal().depth_mm == doctest::Approx(2.0 * bench.view().near_mm));
}

TEST_CASE("motions that no frame was told of leave it under the pointer all the same") {
  Bench bench;
  bench.frame(at(120, 80));
  WindowInput later = at(180, 110);  // another program had the window meanwhile, or it hung
  bench.frame(later);
  CHECK(near(bench.goal().pixel, {180, 110}));
  later = at(90, 60);
  later.left = true;  // out and in again within a frame
  bench.frame(later);
  CHECK(near(bench.goal().pixel, {90, 60}));
  const glm::dvec3 tool_mm = std::exchange(bench.tool_mm, {0.0, 1e4, 1e4});  // behind the eye
  bench.frame(at(50, 50));
  bench.tool_mm = tool_mm;
  bench.frame(at(60, 70));
  CHECK(near(bench.goal().pixel, {60, 70}));
}

TEST_CASE("what keys and views put between pointer and goal stays, and a turn at its end is none") {
  Bench bench;
  bench.frame(at(120, 80));
  bench.camera.orbit(0.0, 10.0);  // as high as it goes
  WindowInput turned = at(120, 80);
  turned.turn_up = 10.0;
  bench.frame(turned);
  const glm::dvec3 before = *bench.hand.goal_mm();
  const glm::dvec2 seen = bench.goal().pixel;
  turned = at(120, 50);
  turned.turn_up = 0.1;  // the view is the same one
  bench.frame(turned);
  CHECK(glm::length(*bench.hand.goal_mm() - before) < 1e-9);
  bench.frame(at(130, 60));
  CHECK(near(bench.goal().pixel, seen + glm::dvec2(10, 10)));
  WindowInput stick = at(130, 60);
  stick.held.right = 1.0;
  bench.frame(stick);
  const glm::dvec2 pushed = bench.goal().pixel;
  CHECK(pushed.x > seen.x + 10.5);
  bench.frame(at(140, 60));
  CHECK(near(bench.goal().pixel, pushed + glm::dvec2(10, 0)));
}

TEST_CASE("a zoom about the goal leaves it under the pointer, and the hand where it is") {
  for (const double steps : {3.0, -2.0, 1e6}) {
    Bench bench;
    bench.frame(at(120, 80));
    const glm::dvec3 before = *bench.hand.goal_mm();
    const double distance_mm = bench.camera.distance_mm();
    bench.camera.zoom_about(before, steps);
    CHECK((bench.camera.distance_mm() < distance_mm) == (steps > 0.0));
    CHECK(near(bench.goal().pixel, {120, 80}));
    if (steps == 1e6) continue;  // nearer than a goal may be: the next frame pushes it away
    WindowInput zoomed = at(120, 80);
    zoomed.zoom = steps;
    bench.frame(zoomed);
    CHECK(glm::length(*bench.hand.goal_mm() - before) < 1e-9);
    bench.frame(at(150, 95));
    CHECK(near(bench.goal().pixel, {150, 95}));
  }
}

TEST_CASE("a window fills the monitor that shows most of it") {
  const std::array<PixelRect, 3> monitors{
      PixelRect{0, 0, 1920, 1080}, {1920, 0, 3840, 1080}, {0, 1080, 800, 1680}};
  CHECK(monitor_of({100, 100, 1380, 900}, monitors) == 0);
  CHECK(monitor_of({1500, 100, 2780, 900}, monitors) == 1);
  CHECK(monitor_of({100, 900, 700, 1400}, monitors) == 2);
  CHECK(monitor_of({-900, -900, -100, -100}, monitors) == 0);  // on one that is gone
  CHECK(monitor_of({0, 0, 10, 10}, {}) == 0);
}

TEST_CASE("a cursor's units are the picture's pixels times the scale of the screen") {
  CHECK(pixels_per_unit({640, 480}, {640, 480}) == glm::dvec2(1.0));
  CHECK(pixels_per_unit({1280, 960}, {640, 480}) == glm::dvec2(2.0));
  CHECK(pixels_per_unit({960, 480}, {640, 480}) == glm::dvec2(1.5, 1.0));
  CHECK(pixels_per_unit({0, 0}, {640, 480}) == glm::dvec2(1.0));  // minimised
  CHECK(pixels_per_unit({640, 480}, {0, 0}) == glm::dvec2(1.0));
}

TEST_CASE("the left button presses along the ray while it is down") {
  Bench bench;
  bench.frame(at(120, 80));
  const glm::dvec3 before = *bench.hand.goal_mm();
  WindowInput press = at(120, 80);
  press.pointer.down = true;
  bench.frame(press);
  CHECK(glm::length(*bench.hand.goal_mm() - before) ==
        doctest::Approx(PointerHand::kPressMm * 2.0));
  CHECK(near(bench.goal().pixel, {120, 80}));
  bench.frame(at(120, 80));
  CHECK(glm::length(*bench.hand.goal_mm() - before) < 1e-9);
  bench.frame(press, true);  // a panel's
  CHECK(glm::length(*bench.hand.goal_mm() - before) < 1e-9);
}

TEST_CASE(
    "the pedal is down while button, space bar or a pad's button is, and not before or after") {
  Bench bench;
  const auto pedal = [&] { return bench.hand.target(bench.device).button1; };
  bench.frame(at(120, 80));
  const glm::dvec3 before = *bench.hand.goal_mm();
  CHECK_FALSE(pedal());
  for (const int by : {0, 1, 2}) {
    CAPTURE(by);
    WindowInput press = at(120, 80);
    press.pointer.down = by == 0;
    press.held.pedal = by == 1;
    press.held.press = by == 2;
    bench.frame(press);
    CHECK(pedal());
    const double deeper_mm = by == 1 ? 0.0 : PointerHand::kPressMm * 2.0;
    CHECK(glm::length(*bench.hand.goal_mm() - before) == doctest::Approx(deeper_mm));
    bench.frame(at(120, 80));
    CHECK_FALSE(pedal());
  }
}

TEST_CASE("a press ends whatever takes the pointer or the view, and does not go on after it") {
  for (const bool by_bar : {false, true}) {
    for (const int way : {0, 1, 2, 3, 4, 5, 6, 7, 8, 9}) {
      CAPTURE(way);
      Bench bench;
      const auto pressed = [&] {
        const bool deep = glm::length(*bench.hand.goal_mm() - bench.tool_mm) > 3.0;
        CHECK((by_bar || deep == bench.hand.target(bench.device).button1));
        return bench.hand.target(bench.device).button1;
      };
      const SeenPoint tool = bench.tool();
      WindowInput press = at(tool.pixel.x, tool.pixel.y);
      bench.frame(press);
      (by_bar ? press.held.pedal : press.pointer.down) = true;
      bench.frame(press);
      REQUIRE(pressed());
      WindowInput away = press;
      if (way == 0) away.hovers = false;  // the pointer is outside, and the button still down
      if (way == 1) away.left = true;     // it was outside, and is back, within one frame
      if (way == 4) bench.hand.come();
      if (way == 5) bench.hand.end_press();
      if (way == 6) away.of_view = true;  // a second button, or shift; nothing has moved yet
      if (way == 7) away.turn_up = 0.01;
      if (way == 8) away.move_right = 0.01;
      if (way == 9) away.zoom = 1.0;
      const glm::dvec3 tool_mm = bench.tool_mm;
      if (way == 3) bench.tool_mm = {0.0, 1e4, 1e4};  // the tool is behind the eye
      bench.frame(way == 3 ? at(tool.pixel.x, tool.pixel.y) : away, way == 2);
      bench.tool_mm = tool_mm;
      CHECK_FALSE(pressed());
      if (way == 3) continue;
      bench.frame(press);
      CHECK_FALSE(pressed());  // back, but never released
      bench.frame(at(tool.pixel.x, tool.pixel.y));
      bench.frame(press);
      CHECK(pressed());
    }
  }
}

TEST_CASE("a camera that turns about the goal leaves it where it is, in world and picture") {
  Bench bench;
  bench.frame(at(120, 80));
  const glm::dvec3 before = *bench.hand.goal_mm();
  bench.camera.orbit_about(before, 0.2, -0.1);
  WindowInput turned = at(180, 110);
  turned.turn_right = 0.2;
  bench.frame(turned);
  CHECK(glm::length(*bench.hand.goal_mm() - before) < 1e-9);
  CHECK(near(bench.goal().pixel, {120, 80}));
  bench.hand.come();
  bench.frame(at(180, 110));
  CHECK(near(bench.goal().pixel, {180, 110}));
}

TEST_CASE("over a panel and away the goal stays; who comes back takes it under the pointer") {
  Bench bench;
  bench.frame(at(120, 80));
  const glm::dvec3 before = *bench.hand.goal_mm();
  bench.frame(at(20, 280), true);
  CHECK(bench.hand.leads());
  CHECK(glm::length(*bench.hand.goal_mm() - before) < 1e-9);
  bench.frame({});
  CHECK_FALSE(bench.hand.leads());
  bench.frame(at(300, 200));
  CHECK(bench.hand.leads());
  CHECK(near(bench.goal().pixel, {300, 200}));
}

TEST_CASE("sticks move the goal by their time, without a pointer, and keys tilt to a wrist's end") {
  Bench bench;
  WindowInput pad;
  pad.held.by_pad = true;
  pad.held.right = 1.0;
  pad.held.deeper = 0.5;
  bench.frame(pad);
  CHECK(bench.hand.leads());
  const double held_mm = PointerHand::kHeldMmPerS * 2.0 * kFrameS;
  CHECK(bench.goal().depth_mm == doctest::Approx(bench.tool().depth_mm + 0.5 * held_mm));
  CHECK(bench.goal().pixel.x > bench.tool().pixel.x);
  bench.frame({});
  CHECK(bench.hand.leads());  // a pad that rests still holds it
  WindowInput tilt = at(100, 100);
  tilt.held.tilt_right = 1.0;
  for (int i = 0; i < 1000; ++i) bench.frame(tilt);
  CHECK(bench.hand.target(bench.device).orientation_rad[0] == doctest::Approx(kMaxTargetRad));
}

TEST_CASE("a tool behind the eye is nobody's to lead") {
  Bench bench;
  bench.tool_mm = {0.0, 1e4, 1e4};
  bench.frame(at(120, 80));
  CHECK_FALSE(bench.hand.leads());
}

namespace {

using Bytes = std::vector<std::uint8_t>;

// As the two layouts are described: x = 350, y = -350 (0xfea2), z = 35.
const Bytes kPush{1, 0x5e, 0x01, 0xa2, 0xfe, 0x23, 0x00};
const Bytes kTurn{2, 0x00, 0x00, 0x5e, 0x01, 0xdd, 0xff};
const Bytes kBoth{1, 0x5e, 0x01, 0xa2, 0xfe, 0x23, 0x00, 0x00, 0x00, 0x5e, 0x01, 0xdd, 0xff};

void check_axes(const SpaceMouseState& state) {
  CHECK(state.push == std::array{1.0, -1.0, 0.1});
  CHECK(state.turn == std::array{0.0, 1.0, -0.1});
}

/// A device that says these reports, one a call, and then nothing or that it is gone.
SpaceMouse mouse_of(std::vector<Bytes> reports, int then) {
  return SpaceMouse([reports, then, next = std::size_t{0}](std::span<std::uint8_t> out) mutable {
    if (next == reports.size()) return then;
    const Bytes& report = reports[next++];
    std::copy(report.begin(), report.end(), out.begin());
    return static_cast<int>(report.size());
  });
}

}  // namespace

TEST_CASE("axes come in two reports, or in one") {
  SpaceMouseState two, one;
  CHECK(take_report(kPush, two));
  CHECK(take_report(kTurn, two));
  CHECK(take_report(kBoth, one));
  check_axes(two);
  check_axes(one);
}

TEST_CASE(
    "the first button is a bit of its own report, and what lies beyond the cap's end its end") {
  SpaceMouseState state;
  CHECK(take_report(Bytes{3, 0x01, 0x00}, state));
  CHECK(state.button);
  CHECK(take_report(Bytes{3, 0x02}, state));
  CHECK_FALSE(state.button);
  CHECK(take_report(Bytes{1, 0xff, 0x7f, 0x00, 0x80, 0x00, 0x00}, state));
  CHECK(state.push == std::array{1.0, -1.0, 0.0});
}

TEST_CASE("what is no report changes nothing: empty, of every wrong length, foreign") {
  SpaceMouseState state;
  REQUIRE(take_report(kBoth, state));
  for (std::uint8_t id = 0; id < 30; ++id) {
    for (std::size_t size = 0; size <= 64; ++size) {
      Bytes report(size, 0x11);
      if (size > 0) report[0] = id;
      const bool known = (id == 1 && (size == 7 || size == 13)) || (id == 2 && size == 7) ||
                         (id == 3 && size >= 2 && size <= 8);
      SpaceMouseState after = state;
      CHECK(take_report(report, after) == known);
      if (!known) check_axes(after);
    }
  }
}

TEST_CASE("the cap moves the hand as it is pushed, and stays held until it says otherwise") {
  SpaceMouse mouse = mouse_of({kPush, kTurn, {3, 1}}, 0);
  for (int frame = 0; frame < 2; ++frame) {
    HeldControls held;
    CHECK_FALSE(mouse.step(held));
    CHECK(held.right == 1.0);
    CHECK(held.deeper == 1.0);  // pushed away from the user
    CHECK(held.up < 0.0);       // and a little down
    CHECK(held.tilt_right == -1.0);
    CHECK(held.tilt_up == 0.0);
    CHECK(held.press);
    CHECK(held.by_pad);
  }
}

TEST_CASE("a cap that is nearly at rest leads no hand") {
  SpaceMouse mouse = mouse_of({{1, 17, 0, 0xef, 0xff, 3, 0}}, 0);  // 17 of 350: 0.0486
  HeldControls held;
  CHECK_FALSE(mouse.step(held));
  CHECK(held.right == 0.0);
  CHECK_FALSE(held.by_pad);
}

TEST_CASE("one that is drawn out lets go of the hand, is told once, and the rest goes on") {
  SpaceMouse mouse = mouse_of({kPush, {3, 1}}, -1);
  HeldControls held;
  held.up = 1.0;  // by a key
  const auto told = mouse.step(held);
  REQUIRE(told);
  CHECK(told->find("SpaceMouse: it is gone; ") == 0);
  CHECK(held.right == 0.0);
  CHECK(held.up == 1.0);
  CHECK_FALSE(held.press);
  CHECK_FALSE(mouse.step(held));
}

TEST_CASE("a device that never stops talking holds up no frame") {
  SpaceMouse mouse([](std::span<std::uint8_t> out) {
    std::copy(kPush.begin(), kPush.end(), out.begin());
    return static_cast<int>(kPush.size());
  });
  HeldControls held;
  CHECK_FALSE(mouse.step(held));
  CHECK(held.right == 1.0);
}

}  // namespace kerf::hand_control_test
