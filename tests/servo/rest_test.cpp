// SPDX-License-Identifier: Apache-2.0
// Parked at rest for 50 ms calibrates, however often the servo and the device look.
#include <algorithm>

#include <doctest/doctest.h>

#include "controller/plan/plan_device.hpp"
#include "controller/servo/sense.hpp"
#include "tests/servo/support.hpp"

namespace kerf::rest_test {

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
  std::unique_ptr<AnyServo> servo;
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
        report.counts[1] = static_cast<std::int16_t>(report.counts[1] + 3);
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
      report.counts[2] = static_cast<std::int16_t>(report.counts[2] + (creeps ? i / 2 : i % 3));
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

TEST_CASE("pressing on the tooth, the sign of parking for 60 ms: a fault, and the world stays") {
  for (const bool latched : {false, true}) {
    CAPTURE(latched);
    LoadedScene scene = half_space_scene();
    ArmedServo armed(scene);
    const ServoOutput before = armed.settled(0, 0.3, 0);
    REQUIRE(before.motors_on);
    for (int tick = 0; latched && tick < 30; ++tick) static_cast<void>(armed.servo->step({}));
    DeviceReport false_dock = armed.arm.at(0, 0.3, 0);
    false_dock.parked = true;
    for (int tick = 0; tick < 60; ++tick) static_cast<void>(armed.servo->step(false_dock));
    const ServoOutput after = armed.settled(0, 0.3, 0);
    CHECK(after.position_mm == before.position_mm);
    CHECK(after.encoder_counts == before.encoder_counts);
    CHECK(after.fault == Fault::wrong_dock);
    CHECK_FALSE(after.motors_on);
    arm_at(*armed.servo, armed.arm, 0, 5, 0);  // the true dock
    CHECK(vec3::length(armed.settled(0, 0.3, 0).commanded_force_n) > 0.1);
  }
}

TEST_CASE("a later rest must be where the first was, within the play of a dock, over the wrap") {
  const SafetyTiming timing;
  for (const Personality personality :
       {Personality::omni, Personality::falcon, Personality::woodenhaptics}) {
    CAPTURE(static_cast<int>(personality));
    ServoPlan<FixedNumbers> plan;
    DeviceSettings device;
    device.personality = personality;
    plan_device(device, plan);
    for (std::size_t joint = 0; joint < 3; ++joint) {
      const auto rest_at = [&](int first, int later) {
        EncoderState encoders;
        Rest rest = Rest::none;
        for (const int at : {first, later}) {
          DeviceReport report{.fresh = true, .parked = true};
          report.counts[joint] = static_cast<std::int16_t>(at);
          for (std::uint32_t tick = 0; tick <= timing.rest_ticks; ++tick) {
            rest = follow_encoders(report, plan.device, timing, encoders);
          }
        }
        return rest;
      };
      const bool has_dock = personality != Personality::falcon;
      const int play = plan.device.dock_counts[joint];
      CHECK((play < 200) == has_dock);
      for (const int first : {0, 32760, -32760}) {
        CHECK(rest_at(first, first + (has_dock ? play : 20'000)) == Rest::docked);
        CHECK(rest_at(first, first - (has_dock ? play : 20'000)) == Rest::docked);
        if (!has_dock) continue;
        CHECK(rest_at(first, first + play + 1) == Rest::elsewhere);
        CHECK(rest_at(first, first - play - 1) == Rest::elsewhere);
      }
    }
  }
}

TEST_CASE("silence alone never calibrates") {
  RestingServo resting(8000);
  for (int i = 0; i < 16; ++i) static_cast<void>(resting.tick());  // two reports
  for (int i = 0; i < 8000; ++i) REQUIRE(resting.tick(false) == Phase::calibrating);
}

TEST_CASE("a rest goes on over 5 ms that the host missed, and starts again after more") {
  for (const std::uint32_t missed : {1U, 4U, 5U, 6U, 19U}) {
    CAPTURE(missed);
    RestingServo resting(1000);
    for (int i = 0; i < 30; ++i) REQUIRE(resting.tick() != Phase::armed);
    REQUIRE(resting.servo->apply({ServoCommand::Kind::missed, missed}));
    int ticks = 0;
    while (resting.tick() != Phase::armed && ++ticks < 1000) {
    }
    CHECK(ticks == (missed <= 5 ? 20 - static_cast<int>(missed) : 49));
  }
}

}  // namespace kerf::rest_test
