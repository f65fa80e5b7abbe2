// SPDX-License-Identifier: Apache-2.0
#include "hil/device/emulator.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "hil/device/falcon.hpp"
#include "hil/device/hand.hpp"
#include "hil/device/wooden.hpp"
#include "hil/script/hand_script_file.hpp"
#include "shared/wire/falcon.hpp"

namespace {

using kerf::DeviceVec;
using kerf::Emulator;
using kerf::OmniCommand;
using kerf::OmniParams;

constexpr int kTickCycles = 8;  // 1 kHz
constexpr int kTicksPerSecond = 1000;

kerf::HandScript hand(const std::string& name = "touch") {
  return kerf::read_hand_script(KERF_HANDS "/" + name + ".toml");
}

void tell(Emulator& emulator, const OmniCommand& command) {
  emulator.receive(kerf::encode(command));
}

/// A host that calibrates at once and then pushes with a slowly turning force.
OmniCommand turning_force(int tick) {
  const double angle = 0.01 * tick;
  const auto count = [&](double phase) {
    return static_cast<std::int16_t>(std::lround(200 * std::sin(angle + phase)));
  };
  return {{count(0), count(1), count(2)}, true, OmniCommand::Light::steady};
}

std::vector<std::uint8_t> twenty_seconds(const OmniParams& params) {
  Emulator emulator(params, hand("cut_cavity"));
  std::vector<std::uint8_t> stream;
  for (int tick = 0; tick < 20 * kTicksPerSecond; ++tick) {
    const auto packet = emulator.next_packet();
    stream.insert(stream.end(), packet.begin(), packet.end());
    tell(emulator, turning_force(tick));
    emulator.advance(kTickCycles);
  }
  return stream;
}

/// Seconds of device time after which the stylus is out of the inkwell.
double undocked_after(const std::optional<OmniCommand>& command) {
  Emulator emulator({}, hand("cut_cavity"));
  CHECK_FALSE(emulator.next_packet().empty());  // it listens, at least
  if (command) tell(emulator, *command);
  emulator.advance(4 * kerf::omni::kBusCyclesPerSecond);
  REQUIRE(emulator.stats().undocked_at);
  return static_cast<double>(*emulator.stats().undocked_at) / kerf::omni::kBusCyclesPerSecond;
}

}  // namespace

TEST_CASE("twenty seconds of a script are the same bytes every time, and others by another seed") {
  OmniParams params;
  params.pot_noise = true;
  const auto first = twenty_seconds(params);
  CHECK(first.size() == 20'000 * kerf::omni::kReportBytes);
  CHECK(first == twenty_seconds(params));
  params.seed = 2;
  CHECK(first != twenty_seconds(params));
}

TEST_CASE("the hand waits for a calibrated host 50 ms, for any other 2 s") {
  using Light = OmniCommand::Light;
  CHECK(undocked_after(OmniCommand{{}, false, Light::steady}) ==
        doctest::Approx(0.05).epsilon(1e-2));
  CHECK(undocked_after(OmniCommand{{}, true, Light::off}) == doctest::Approx(0.05).epsilon(1e-2));
  CHECK(undocked_after(OmniCommand{{}, false, Light::slow_flash}) ==
        doctest::Approx(2.0).epsilon(1e-3));
  CHECK(undocked_after(std::nullopt) == doctest::Approx(2.0).epsilon(1e-3));
}

TEST_CASE("the hand waits for a host at all, and then homes a Falcon as if it had just begun") {
  Emulator emulator(std::make_unique<kerf::FalconModel>(), hand("cut_cavity"));
  emulator.advance(10 * kerf::kCyclesPerSecond);
  const auto all_homed = [&] {
    for (int tick = 0; tick < kTicksPerSecond; ++tick) {
      emulator.receive(encode(kerf::FalconCommand{.motor = {}, .homing = true}));
      emulator.advance(kTickCycles);
      const auto report = kerf::falcon::decode_report(emulator.next_packet());
      if (report && report->homed == std::array{true, true, true}) return true;
    }
    return false;
  };
  CHECK(all_homed());
}

TEST_CASE("without a hand the stylus stays in the inkwell") {
  Emulator emulator({}, std::nullopt);
  emulator.advance(5 * kerf::omni::kBusCyclesPerSecond);
  CHECK_FALSE(emulator.stats().undocked_at);
  CHECK(kerf::decode_report(emulator.next_packet())->docked);
}

TEST_CASE("the tip follows the script to the surface within friction and inertia") {
  Emulator emulator({}, hand("cut_cavity"));
  tell(emulator, {{}, true, OmniCommand::Light::steady});
  const kerf::HandRoute route = emulator.model().route();
  const double reach_s =
      kerf::reach_curve(route, route.rest_tip_mm, {0, 4, 0}).least_seconds(route.hand_rad_per_s);
  emulator.advance(static_cast<int>((0.05 + reach_s) * kerf::omni::kBusCyclesPerSecond));
  CHECK(norm(emulator.model().tip_mm() - DeviceVec<double>{0, 4, 0}) < kerf::ReachCurve::kSwingMm);
  emulator.advance(8 * kerf::omni::kBusCyclesPerSecond);
  // One round later it is up and aside.
  CHECK(norm(emulator.model().tip_mm() - DeviceVec<double>{3, 5, 0}) < 1.5);
}

TEST_CASE("a packet that is no command changes nothing but a count") {
  Emulator emulator({}, std::nullopt);
  tell(emulator, {{500, 500, 500}, true, OmniCommand::Light::steady});
  const std::array<std::uint8_t, 16> wrong{};
  emulator.receive(wrong);
  emulator.receive({});
  emulator.advance(1);
  CHECK(emulator.stats().commands == 1);
  CHECK(emulator.stats().refused == 2);
  CHECK(emulator.model().motors_on());
  CHECK(emulator.stats().peak_motor_force_n > 0);
}

// ---- Falcon and WoodenHaptics: calibration by host and hand, the script ----

namespace {

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
  const auto seen = kerf::FalconArm{}.tip_mm({angle(0), angle(1), angle(2)});
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
