// SPDX-License-Identifier: Apache-2.0
// How stiff a floor a program may render at its own rate: by a force that it computes, and by a
// goal that the servo pulls to. The emulated hand presses 1.5 mm deep and stays; a floor counts as
// still if the tip moves by less than 20 um (rms) in the fifth second. Lock-step: the same figures
// on every machine.
//
//     rates SCENE DEVICE       the scene external.toml; omni, omega, falcon
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>

#include <kerf/hand.hpp>
#include <kerf/servo.hpp>

namespace {

constexpr int kRateHz = 1000, kTicks = 5000;
constexpr double kDamping = 0.002, kHighest = 20, kStep = 1.12, kStillMm = 0.02;

const char* const kPress =
    "start_mm = [0, 4, 0]\n[[step]]\nmove_mm = [0, -1.5, 0]\nseconds = 0.6\n[[step]]\nhold = 20\n";

/// Of the last second, mm.
double swing(const kerf::Scene& scene, const std::string& hand_file, double stiffness,
             int client_hz, bool by_goal) {
  kerf::Servo servo(scene);
  kerf::Hand hand(scene, hand_file);
  double sum = 0, squares = 0;
  int count = 0;
  for (int i = 0; i < kTicks; ++i) {
    const kerf::TickRecord& tick = servo.step(hand.next(servo.last()));
    const double y = tick.position_mm[1], v = static_cast<double>(tick.velocity_mm_per_s[1]);
    if (i % (kRateHz / client_hz) == 0 && std::isfinite(v)) {
      kerf::ProgramForce force;
      if (y < 0 && by_goal) {
        force = {.goal_mm = {tick.position_mm[0], 0, tick.position_mm[2]},
                 .stiffness_n_per_mm = stiffness,
                 .damping_ns_per_mm = kDamping};
      } else if (y < 0) {
        force.force_n[1] = -stiffness * y - kDamping * v;
      }
      servo.give_force(force);
    }
    if (i < kTicks - kRateHz) continue;
    sum += y;
    squares += y * y;
    ++count;
  }
  return std::sqrt(std::max(0.0, squares / count - sum / count * (sum / count)));
}

}  // namespace

int main(int count, char** words) try {
  if (count != 3) return std::puts("usage: rates SCENE DEVICE"), 2;
  const auto scene =
      kerf::Scene::load(words[1], {std::string("device.personality=\"") + words[2] + "\"",
                                   "force.stiffness_n_per_mm=20", "force.damping_ns_per_mm=0.01",
                                   "force.unchecked_gain=true", "limits.force_n=3"});
  const std::string hand_file = "rates-hand.toml";
  std::ofstream(hand_file) << kPress;
  std::puts("program_hz,force_n_per_mm,goal_n_per_mm");
  for (const int client_hz : {1000, 500, 200, 100, 50}) {
    double highest[2]{};
    for (const bool by_goal : {false, true}) {
      for (double k = 0.1; k < kHighest; k *= kStep) {
        if (swing(scene, hand_file, k, client_hz, by_goal) > kStillMm) break;
        highest[by_goal ? 1 : 0] = k;
      }
    }
    std::printf("%d,%.2f,%.2f\n", client_hz, highest[0], highest[1]);
  }
  std::remove(hand_file.c_str());
} catch (const kerf::Error& error) {
  std::fprintf(stderr, "rates: %s\n", error.what());
  return 1;
}
