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
#include "shared/wire/woodenhaptics.hpp"

namespace kerf::emulator_test {
namespace {

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

/// The same of a device whose host does not move the motors.
template <class Model>
std::uint64_t hash_of_eight_seconds(const std::vector<std::uint8_t>& command) {
  Emulator emulator(std::make_unique<Model>(), hand("cut_cavity"));
  for (int tick = 0; tick < 8 * kTicksPerSecond; ++tick) {
    emulator.receive(command);
    emulator.advance(kTickCycles);
    static_cast<void>(emulator.next_packet());
  }
  CHECK_FALSE(emulator.model().docked());
  CHECK(emulator.stats().reports > 7000);
  return emulator.stats().report_hash;
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

  const auto homing = encode(kerf::FalconCommand{.motor = {}, .homing = true});
  const std::vector<std::uint8_t> falcon(homing.begin(), homing.end());
  CHECK(hash_of_eight_seconds<kerf::FalconModel>(falcon) ==
        hash_of_eight_seconds<kerf::FalconModel>(falcon));
  // Each command sets the encoders: the hand presses the button once, and then leaves.
  const auto home =
      encode(kerf::WoodenCommand{{}, std::array<std::int16_t, 6>{0, 0, 6000, 0, 0, 0}});
  const std::vector<std::uint8_t> arm(home.begin(), home.begin() + 14);
  CHECK(hash_of_eight_seconds<kerf::WoodenModel>(arm) ==
        hash_of_eight_seconds<kerf::WoodenModel>(arm));
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

TEST_CASE("a Falcon whose host never requests homing is moved after 2 s all the same") {
  Emulator emulator(std::make_unique<kerf::FalconModel>(), hand());
  emulator.receive(encode(kerf::FalconCommand{}));
  emulator.advance(kerf::kCyclesPerSecond * 19 / 10);
  CHECK(emulator.model().docked());
  emulator.advance(kerf::kCyclesPerSecond * 2 / 10);
  CHECK_FALSE(emulator.model().docked());
}

TEST_CASE("a packet of another device is refused and changes nothing") {
  Emulator one(std::make_unique<kerf::FalconModel>(), std::nullopt);
  one.receive(encode(kerf::OmniCommand{}));
  one.receive(encode(kerf::WoodenCommand{}));
  CHECK(one.stats().refused == 2);
  one.advance(kTickCycles);
  CHECK(one.next_packet().empty());
  Emulator other(std::make_unique<kerf::WoodenModel>(), std::nullopt);
  other.receive(encode(kerf::FalconCommand{}));
  CHECK(other.stats().refused == 1);
  other.advance(kTickCycles);
  CHECK(other.next_packet().empty());
}

}  // namespace kerf::emulator_test
