// SPDX-License-Identifier: Apache-2.0
// All devices arm at every rate of the servo, in the same time.
#include <algorithm>

#include <doctest/doctest.h>

#include "hil/device/emulator.hpp"
#include "hil/device/packet_device.hpp"
#include "lab/rig/virtual_loop.hpp"
#include "tests/servo/support.hpp"

namespace kerf::arming_test {
namespace {

/// From the first bus cycle until the motors go on, in emulated ms; 10 s if they never do.
double arming_ms(Personality personality, int rate_hz) {
  kerf::LoadedScene scene = kerf::test::half_space_scene(8);
  scene.device.personality = personality;
  scene.servo.rate_hz = rate_hz;
  kerf::HandScript hand;
  hand.steps = {kerf::hand_move({0, 4, 0}, 10)};
  kerf::Emulator emulator(
      kerf::with_device_params(personality,
                               [](const auto& params) { return kerf::make_model(params); }),
      hand);
  kerf::DirectPort port(emulator);
  kerf::VirtualLoop loop(scene, port);
  while (loop.cycles() < 10 * kerf::kCyclesPerSecond) {
    if (loop.tick().motors_on)
      return static_cast<double>(loop.cycles()) * 1000 / kerf::kCyclesPerSecond;
  }
  return 10'000;
}

}  // namespace

TEST_CASE("every device arms at every rate in the same time") {
  for (const Personality personality :
       {Personality::omni, Personality::falcon, Personality::woodenhaptics}) {
    const auto name = kerf::word_of(personality);
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

}  // namespace kerf::arming_test
