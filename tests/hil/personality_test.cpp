// SPDX-License-Identifier: Apache-2.0
// Whole runs of the three devices behind the emulator: calibration by host and hand, the script,
// and the same bytes again.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "hil/device/emulator.hpp"
#include "hil/device/falcon.hpp"
#include "hil/device/omni.hpp"
#include "hil/device/wooden.hpp"
#include "hil/script/hand_script_file.hpp"
#include "tests/hil/model_runs.hpp"

namespace {

using kerf::Emulator;
using kerf::FalconArm;

constexpr int kTickCycles = 8;  // 1 kHz
constexpr int kTicksPerSecond = 1000;

std::optional<kerf::HandScript> hand(const std::string& name = "touch") {
  return kerf::read_hand_script(KERF_HANDS "/" + name + ".toml");
}

Emulator falcon(const std::optional<kerf::HandScript>& script) {
  return Emulator(std::make_unique<kerf::FalconModel>(), script);
}
Emulator wooden(const std::optional<kerf::HandScript>& script) {
  return Emulator(std::make_unique<kerf::WoodenModel>(), script);
}

/// A Falcon's host: asks for homing until all legs are homed, then pushes a little.
struct FalconHost {
  bool homed = false;
  std::vector<std::uint8_t> stream;
  kerf::FalconReport report;
  int homed_tick = 0;

  void tick(Emulator& emulator, int now) {
    const std::int16_t push = static_cast<std::int16_t>(100 * std::sin(0.01 * now));
    const kerf::FalconCommand homing{{}, true, false, false, true};
    const kerf::FalconCommand pushing{{push, push, push}, false, true, false, false};
    emulator.receive(encode(homed ? pushing : homing));
    emulator.advance(kTickCycles);
    const auto packet = emulator.next_packet();
    REQUIRE(packet.size() == kerf::falcon::kPacketBytes);
    stream.insert(stream.end(), packet.begin(), packet.end());
    report = *kerf::falcon::decode_report(packet);
    const bool all = report.homed[0] && report.homed[1] && report.homed[2];
    if (all && !homed) homed_tick = now;
    homed |= all;
  }
};

/// The host of a WoodenHaptics arm: sets the encoders when the button is pressed, then pushes.
struct WoodenHost {
  bool calibrated = false;
  std::vector<std::uint8_t> stream;
  kerf::WoodenReport report;

  void tick(Emulator& emulator, int now) {
    kerf::WoodenCommand command;
    if (report.calibrate) {
      command.set_encoders = {0, 0, 6000, 0, 0, 0};
      calibrated = true;
    } else if (calibrated) {
      const auto push = static_cast<std::int16_t>(200 * std::sin(0.01 * now));
      command.milliamps = {push, push, push};
    }
    emulator.receive(std::span<const std::uint8_t>(encode(command)).first(14));
    emulator.advance(kTickCycles);
    const auto packet = emulator.next_packet();
    REQUIRE(packet.size() == kerf::wooden::kPacketBytes);
    stream.insert(stream.end(), packet.begin(), packet.end());
    report = *kerf::wooden::decode_report(packet);
  }
};

template <class Host>
Host run(Emulator& emulator, int ticks) {
  Host host;
  for (int tick = 0; tick < ticks; ++tick) host.tick(emulator, tick);
  return host;
}

}  // namespace

TEST_CASE("the hand homes a Falcon whose host asks for it, then plays its script") {
  Emulator emulator = falcon(hand());
  const auto host = run<FalconHost>(emulator, 4 * kTicksPerSecond);
  CHECK(host.homed);
  CHECK(host.homed_tick < 1000);
  CHECK_FALSE(emulator.model().docked());
  // The host's view, from counts alone, is where the tip is.
  const auto angle = [&](std::size_t i) {
    return kerf::falcon::kZeroRad + kerf::falcon::kRadPerCount * host.report.encoder[i];
  };
  const auto seen = FalconArm{}.tip_mm({angle(0), angle(1), angle(2)});
  CHECK(norm(seen - emulator.model().tip_mm()) < 0.2);
  CHECK(std::abs(seen.y) < 10);  // at the script's surface, not 20 mm above
}

TEST_CASE("a Falcon whose host never asks for homing is moved after 2 s all the same") {
  Emulator emulator = falcon(hand());
  emulator.receive(encode(kerf::FalconCommand{}));
  emulator.advance(kerf::kCyclesPerSecond * 19 / 10);
  CHECK(emulator.model().docked());
  emulator.advance(kerf::kCyclesPerSecond * 2 / 10);
  CHECK_FALSE(emulator.model().docked());
}

TEST_CASE("the hand presses the WoodenHaptics button and leaves home once the encoders are set") {
  Emulator emulator = wooden(hand());
  WoodenHost host;
  for (int tick = 0; tick < 50; ++tick) host.tick(emulator, tick);
  CHECK(host.calibrated);
  CHECK(emulator.model().docked());
  for (int tick = 0; tick < 3 * kTicksPerSecond; ++tick) host.tick(emulator, tick);
  CHECK_FALSE(emulator.model().docked());
  const auto angle = [&](std::size_t i) {
    return kerf::wooden::kRadPerCount[i] * host.report.encoder[i];
  };
  const auto seen = kerf::WoodenArm{}.tip_mm({angle(0), angle(1), angle(2)});
  CHECK(norm(seen - emulator.model().tip_mm()) < 0.3);
  CHECK(std::abs(seen.y) < 10);
}

TEST_CASE("two runs of a Falcon and of a WoodenHaptics arm are the same bytes") {
  constexpr int kTicks = 8 * kTicksPerSecond;
  Emulator falcons[] = {falcon(hand("cut_cavity")), falcon(hand("cut_cavity"))};
  const auto first = run<FalconHost>(falcons[0], kTicks);
  CHECK(run<FalconHost>(falcons[1], kTicks).stream == first.stream);
  CHECK(falcons[0].stats().report_hash == falcons[1].stats().report_hash);
  Emulator woodens[] = {wooden(hand("cut_cavity")), wooden(hand("cut_cavity"))};
  const auto second = run<WoodenHost>(woodens[0], kTicks);
  CHECK(run<WoodenHost>(woodens[1], kTicks).stream == second.stream);
  CHECK(woodens[0].stats().report_hash == woodens[1].stats().report_hash);
}

TEST_CASE("every script of the project stays in the reach of a Falcon and of WoodenHaptics") {
  for (const std::string name : {"approach", "touch", "slide", "cut_cavity", "jerk"}) {
    CAPTURE(name);
    kerf::HandMotion for_falcon(*hand(name), kerf::FalconModel().route());
    kerf::HandMotion for_wooden(*hand(name), kerf::WoodenModel().route());
    bool in_reach = true;
    double fastest = 0;
    for (kerf::HandMotion* motion : {&for_falcon, &for_wooden}) {
      motion->calibrate();
      for (int cycle = 0; cycle < kerf::kCyclesPerSecond; ++cycle) {
        in_reach &= FalconArm::within_limits(motion->next().target_mm);
      }
      motion->leave();
      auto last = motion->next().target_mm;
      for (int cycle = 0; cycle < 15 * kerf::kCyclesPerSecond; ++cycle) {
        const auto target = motion->next().target_mm;
        const double speed = norm(target - last) * kerf::kCyclesPerSecond;
        if (motion->arrived()) fastest = std::max(fastest, speed);
        last = target;
        if (motion == &for_falcon) in_reach &= FalconArm::within_limits(target);
        const kerf::WoodenArm arm;
        if (motion == &for_wooden) in_reach &= arm.within_limits(arm.joints_rad(target));
      }
    }
    CHECK(in_reach);
    CHECK(fastest < (name == "jerk" ? 1100 : 500));
  }
}

TEST_CASE("no jump of a hand takes a Falcon or a WoodenHaptics arm out of its end stops") {
  CHECK(rc::check([] {
    kerf::FalconModel one;
    kerf::WoodenModel other;
    for (int jump = 0; jump < 4; ++jump) {
      const auto goal = kerf::test::at(kerf::test::any_in_ball(600));
      for (int cycle = 0; cycle < kerf::kCyclesPerSecond / 4; ++cycle) {
        one.step(goal);
        other.step(goal);
        RC_ASSERT(norm(one.tip_mm()) < kerf::falcon::kReachMm + 1e-9);
        // What a jump of 1.2 m gives at most through damper and spring: (b + sqrt(k m)) d / m.
        RC_ASSERT(norm(one.velocity_mm_per_s()) < 170'000);
        const auto q = other.joints_rad();
        constexpr double kSlackRad = 1e-9;
        RC_ASSERT(std::abs(q.x) < 1.0 + kSlackRad);
        RC_ASSERT(q.y > -0.35 - kSlackRad);
        RC_ASSERT(q.y < 1.35 + kSlackRad);
        RC_ASSERT(q.y + q.z > 0.45 - kSlackRad);
        RC_ASSERT(q.y + q.z < 2.6 + kSlackRad);
        RC_ASSERT(norm(other.velocity_mm_per_s()) < 170'000);
      }
    }
  }));
}

TEST_CASE("a packet of another device is refused and changes nothing") {
  Emulator one = falcon(std::nullopt);
  one.receive(encode(kerf::OmniCommand{}));
  one.receive(encode(kerf::WoodenCommand{}));
  CHECK(one.stats().refused == 2);
  one.advance(kTickCycles);
  CHECK(one.next_packet().empty());
  Emulator other = wooden(std::nullopt);
  other.receive(encode(kerf::FalconCommand{}));
  CHECK(other.stats().refused == 1);
  other.advance(kTickCycles);
  CHECK(other.next_packet().empty());
}
