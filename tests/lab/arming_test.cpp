// SPDX-License-Identifier: Apache-2.0
// All devices arm at every rate of the servo, in the same time.
#include <algorithm>
#include <memory>

#include <doctest/doctest.h>

#include "controller/device/device_driver.hpp"
#include "hil/device/emulator.hpp"
#include "hil/device/falcon.hpp"
#include "hil/device/omni.hpp"
#include "hil/device/packet_device.hpp"
#include "hil/device/wooden.hpp"
#include "lab/rig/direct_port.hpp"
#include "tests/servo/support.hpp"

using kerf::Personality;

namespace {

kerf::Emulator emulator_of(Personality personality, const kerf::HandScript& hand) {
  switch (personality) {
    case Personality::falcon:
      return {std::make_unique<kerf::FalconModel>(kerf::FalconParams{}), hand};
    case Personality::woodenhaptics:
      return {std::make_unique<kerf::WoodenModel>(kerf::WoodenParams{}), hand};
    case Personality::omni:
      break;
  }
  return {kerf::OmniParams{}, hand};
}

/// From the first bus cycle until the motors go on, in emulated ms; 10 s where they never do.
double arming_ms(Personality personality, int rate_hz) {
  kerf::LoadedScene scene = kerf::test::half_space_scene(8);
  scene.device.personality = personality;
  scene.servo.rate_hz = rate_hz;
  const auto servo = kerf::compile(scene);
  kerf::HandScript hand;
  hand.steps = {kerf::hand_move({0, 4, 0}, 10)};
  kerf::Emulator emulator = emulator_of(personality, hand);
  kerf::DirectPort port(emulator);
  const auto driver = kerf::make_driver(personality, port);
  driver->start();
  for (int cycle = 0; cycle < 10 * kerf::kCyclesPerSecond; ++cycle) {
    port.cycle();
    if ((cycle + 1) % (kerf::kCyclesPerSecond / rate_hz) != 0) continue;
    const kerf::ServoOutput output = servo->step(driver->read());
    driver->command(output);
    if (output.motors_on) return (cycle + 1) * 1000.0 / kerf::kCyclesPerSecond;
  }
  return 10'000;
}

}  // namespace

TEST_CASE("every device arms at every rate in the same time") {
  for (const Personality personality :
       {Personality::omni, Personality::falcon, Personality::woodenhaptics}) {
    const auto name = kerf::kPersonalityWords[static_cast<std::size_t>(personality)];
    double shortest_ms = 10'000, longest_ms = 0;
    for (const int rate_hz : {250, 1000, 2000, 4000, 8000}) {
      const double ms = arming_ms(personality, rate_hz);
      MESSAGE(name << " at " << rate_hz << " Hz: " << ms << " ms");
      shortest_ms = std::min(shortest_ms, ms);
      longest_ms = std::max(longest_ms, ms);
    }
    CHECK(longest_ms < 3000);
    CHECK(longest_ms - shortest_ms <= 16);  // four ticks of the slowest: home, see, rest, see
  }
}
