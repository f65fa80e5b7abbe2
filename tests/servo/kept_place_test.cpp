// SPDX-License-Identifier: Apache-2.0
// What must not move the proxy to the other side of a wall: commands, pauses and glitches.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include <doctest/doctest.h>

#include "tests/servo/support.hpp"

namespace kerf::kept_place_test {

using namespace kerf::test;

namespace {

/// A wall of two voxels about y = 0, balls of radius 1 mm (twice) and 0.5 mm; nothing is cut.
LoadedScene wall_scene(NumericKind numeric, int rate_hz) {
  LoadedScene scene = half_space_scene(64);
  scene.volumes[0] = volume_of(
      64, kVoxelMm, [](double, double y, double) { return (std::abs(y) - kVoxelMm) / 2; });
  scene.tools.push_back(scene.tools[0]);
  scene.tools.push_back(ball(8));
  scene.servo.numeric = numeric;
  scene.servo.rate_hz = rate_hz;
  return scene;
}

constexpr double kBehindMm = -2.5;

constexpr std::array<double, 3> kAround{0, 30, -60};  ///< from the inkwell, past the wall's end

/// In steps of 0.05 mm.
void lead(ArmedServo& armed, const std::array<double, 3>& from, const std::array<double, 3>& to) {
  const double length_mm = length(vec3::operator-(to, from));
  const int steps = static_cast<int>(length_mm / 0.05);
  for (int i = 1; i <= steps; ++i) {
    const double s = double(i) / steps;
    static_cast<void>(armed.step(from[0] + s * (to[0] - from[0]), from[1] + s * (to[1] - from[1]),
                                 from[2] + s * (to[2] - from[2])));
  }
}

/// The hand pressed through the wall, `disturb` done, and 0.3 s later: the force from above, in N.
double force_after(NumericKind numeric, int rate_hz,
                   const std::function<void(ArmedServo&)>& disturb) {
  LoadedScene scene = wall_scene(numeric, rate_hz);
  ArmedServo armed(scene, kAround, std::max(1, rate_hz / 1000));
  lead(armed, kAround, {0, 3, 0});
  lead(armed, {0, 3, 0}, {0, kBehindMm, 0});
  REQUIRE(armed.settled(0, kBehindMm, 0).commanded_force_n[1] > 1.2);
  disturb(armed);
  ServoOutput out;
  for (int tick = 0; tick < rate_hz * 3 / 10; ++tick) out = armed.step(0, kBehindMm, 0);
  CHECK(out.position_mm[1] + out.proxy_offset_mm[1] > 0);  // on its side of the wall
  return out.commanded_force_n[1];
}

ServoCommand select(std::uint32_t tool) {
  return {.kind = ServoCommand::Kind::select_tool, .argument = tool};
}
ServoCommand hold(bool on) {
  return {.kind = ServoCommand::Kind::hold, .argument = on ? 1U : 0U};
}

}  // namespace

TEST_CASE("behind a wall the force survives commands, holds and glitches, on its own side") {
  for (const auto numeric : {NumericKind::fixed, NumericKind::float64}) {
    for (const int rate_hz : {250, 1000, 8000}) {
      CAPTURE(static_cast<int>(numeric));
      CAPTURE(rate_hz);
      const auto after = [&](const auto& disturb) {
        return force_after(numeric, rate_hz, disturb);
      };
      const double undisturbed_n = after([](ArmedServo&) {});
      const auto same = doctest::Approx(undisturbed_n).epsilon(0.02);
      CHECK(after([](ArmedServo& armed) { CHECK(armed.servo->apply(select(0))); }) == same);
      CHECK(after([](ArmedServo& armed) { CHECK_FALSE(armed.servo->apply(select(3))); }) == same);
      CHECK(after([](ArmedServo& armed) { CHECK(armed.servo->apply(select(1))); }) == same);
      CHECK(after([](ArmedServo& armed) {
              armed.servo->apply(hold(true));
              for (int tick = 0; tick < 30; ++tick) {
                CHECK(armed.step(0, kBehindMm, 0).contact_force_n[1] == 0);
              }
              armed.servo->apply(hold(false));
            }) == same);
      CHECK(after([](ArmedServo& armed) {
              DeviceReport report = armed.arm.at(0, kBehindMm, 0);
              report.parked = true;
              CHECK_FALSE(armed.servo->step(report).motors_on);
            }) == same);
      // A smaller tool rests nearer to the wall.
      CHECK(after([](ArmedServo& armed) { armed.servo->apply(select(2)); }) ==
            doctest::Approx(undisturbed_n - 0.4 * 0.5).epsilon(0.03));
    }
  }
}

TEST_CASE("choosing the tool that is chosen changes no bit, even in contact") {
  LoadedScene scene = wall_scene(NumericKind::fixed, 1000),
              other = wall_scene(NumericKind::fixed, 1000);
  ArmedServo armed(scene, kAround), asked(other, kAround);
  lead(armed, kAround, {0, 3, 0});
  lead(asked, kAround, {0, 3, 0});
  for (int tick = 0; tick < 200; ++tick) {
    const double y_mm = std::max(kBehindMm, 3 - 0.05 * tick);
    if (tick % 3 == 0) asked.servo->apply(select(tick % 2 == 0 ? 0 : 99));
    CHECK(armed.step(0, y_mm, 0).output_hash == asked.step(0, y_mm, 0).output_hash);
  }
}

}  // namespace kerf::kept_place_test
