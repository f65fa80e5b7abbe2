// SPDX-License-Identifier: Apache-2.0
// Parked at rest for 50 ms calibrates, however often the servo and the device look.
#include <algorithm>

#include <doctest/doctest.h>

#include "tests/servo/support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

constexpr int kReportsPerS = 1000;

struct RestingServo {
  explicit RestingServo(int rate) : rate_hz(rate) {
    LoadedScene scene = half_space_scene(8);
    scene.servo.rate_hz = rate;
    servo = compile(scene);
  }

  /// One tick in which the device may have said something since the last one.
  Phase tick(bool device_speaks = true) {
    const int due = ++ticks * kReportsPerS / rate_hz;
    DeviceReport report;
    if (device_speaks && due > said) report = arm.docked();
    said = due;
    return servo->step(report).phase;
  }
  [[nodiscard]] double now_ms() const { return ticks * 1000.0 / rate_hz; }

  int rate_hz;
  int ticks = 0, said = 0;
  KinematicOmni arm;
  std::unique_ptr<Servo> servo;
};

/// From the first report, which only tells where the arm is, to the end of the rest.
double rest_ms(RestingServo& resting) {
  while (resting.tick() == Phase::off) {
  }
  const double began_ms = resting.now_ms();
  while (resting.tick() == Phase::calibrating && resting.now_ms() < 1000) {
  }
  return resting.now_ms() - began_ms;
}

}  // namespace

TEST_CASE("50 ms of rest calibrate at every rate of the servo, with 1000 reports a second") {
  for (const int rate_hz : {100, 250, 333, 500, 1000, 2000, 4000, 8000}) {
    CAPTURE(rate_hz);
    RestingServo resting(rate_hz);
    const double ms = rest_ms(resting);
    const double tick_ms = std::max(1000.0 / rate_hz, 1000.0 / kReportsPerS);
    CHECK(ms >= 49.999);
    CHECK(ms <= 50 + 2 * tick_ms);
  }
}

TEST_CASE("a device that says nothing for more than 5 ms, or moves, has to rest anew") {
  for (const int rate_hz : {1000, 8000}) {
    CAPTURE(rate_hz);
    for (const bool moves : {false, true}) {
      CAPTURE(moves);
      RestingServo resting(rate_hz);
      while (resting.now_ms() < 48) REQUIRE(resting.tick() != Phase::armed);
      const double gap_from_ms = resting.now_ms();
      if (moves) {
        DeviceReport report = resting.arm.docked();
        report.encoder[1] = static_cast<std::int16_t>(report.encoder[1] + 3);
        static_cast<void>(resting.servo->step(report));
      } else {
        while (resting.now_ms() < gap_from_ms + 8) REQUIRE(resting.tick(false) != Phase::armed);
      }
      CHECK(rest_ms(resting) >= 49);
    }
  }
}

TEST_CASE("an arm that creeps by a count in two reports is not at rest; one that jitters is") {
  for (const bool creeps : {true, false}) {
    CAPTURE(creeps);
    RestingServo resting(1000);
    Phase phase = Phase::off;
    for (int i = 0; i < 300; ++i) {
      DeviceReport report = resting.arm.docked();
      report.encoder[2] = static_cast<std::int16_t>(report.encoder[2] + (creeps ? i / 2 : i % 3));
      phase = resting.servo->step(report).phase;
      if (creeps) REQUIRE(phase == Phase::calibrating);
    }
    CHECK((phase == Phase::armed) == !creeps);
  }
}

TEST_CASE("a gap of 4 ms does not end a rest") {
  for (const int rate_hz : {1000, 8000}) {
    CAPTURE(rate_hz);
    RestingServo resting(rate_hz);
    while (resting.now_ms() < 40) REQUIRE(resting.tick() != Phase::armed);
    while (resting.now_ms() < 44) REQUIRE(resting.tick(false) != Phase::armed);
    while (resting.now_ms() < 55) static_cast<void>(resting.tick());
    CHECK(resting.tick() == Phase::armed);
  }
}

TEST_CASE("silence alone never calibrates") {
  RestingServo resting(8000);
  for (int i = 0; i < 16; ++i) static_cast<void>(resting.tick());  // two reports
  for (int i = 0; i < 8000; ++i) REQUIRE(resting.tick(false) == Phase::calibrating);
}
