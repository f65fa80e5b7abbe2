// SPDX-License-Identifier: Apache-2.0
#include "hil/device/emulator.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <doctest/doctest.h>

#include "hil/device/falcon.hpp"
#include "hil/device/hand.hpp"
#include "hil/script/hand_script_file.hpp"
#include "shared/wire/falcon.hpp"

namespace {

using kerf::DeviceVec;
using kerf::Emulator;
using kerf::OmniCommand;
using kerf::OmniParams;

constexpr int kTickCycles = 8;  // 1 kHz
constexpr int kTicksPerSecond = 1000;

kerf::HandScript cut_cavity() {
  return kerf::read_hand_script(KERF_HANDS "/cut_cavity.toml");
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
  Emulator emulator(params, cut_cavity());
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
  Emulator emulator({}, cut_cavity());
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
  Emulator emulator(std::make_unique<kerf::FalconModel>(), cut_cavity());
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
  Emulator emulator({}, cut_cavity());
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
