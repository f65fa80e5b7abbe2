// SPDX-License-Identifier: Apache-2.0
// The servo core without a device or a clock: an Omni presses ever deeper, and each line is a depth
// of its tip and the force that it gets.    press SCENE.toml
#include <cstdio>

#include "controller/load/load_scene.hpp"
#include "controller/plan/compile.hpp"
#include "lab/rig/kinematic_arm.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "press: no scene; give one, such as wall.toml\n"), 2;
  try {
    kerf::SceneOverrides motors;
    motors.torque_scale = {0.342, 0.342, 0.342};  // N mm at the joint per motor count
    kerf::LoadedScene scene = kerf::load_scene(argv[1], motors);
    const auto servo = kerf::compile(scene);
    kerf::KinematicOmni arm;
    kerf::arm_at(*servo, arm, 0, 5, 0);  // docked, taken in hand, led to 5 mm above the middle
    for (int tick = 0; tick <= 7000; ++tick) {
      const double y_mm = 5 - 0.001 * tick;
      const kerf::ServoOutput out = servo->step(arm.at(0, y_mm, 0));
      if (tick % 500 == 0) std::printf("%5.2f mm %6.3f N\n", y_mm, out.force_n[1]);
    }
  } catch (const std::exception& error) {
    return std::fprintf(stderr, "press: %s\n", error.what()), 2;
  }
}
