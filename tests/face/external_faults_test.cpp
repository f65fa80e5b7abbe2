// SPDX-License-Identifier: Apache-2.0
// Whatever a program gives, and whatever its device does meanwhile: the promises of docs/safety.md.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>

#include <doctest/doctest.h>
#include <kerf/hand.hpp>
#include <kerf/scene.hpp>
#include <kerf/servo.hpp>
#include <kerf/tick.hpp>

namespace kerf::external_faults_test {
namespace {

constexpr int kSeeds = 20, kTicks = 1200;
const std::string kScenes = KERF_SCENES;

/// A program that behaves in one way for a while, then in another one.
class Program {
 public:
  explicit Program(std::uint32_t seed) : random_(seed) {}

  /// What it gives before this tick; nothing in some of its ways.
  void turn(kerf::Servo& servo) {
    if (left_-- <= 0) {
      way_ = below(7);
      left_ = 20 + below(150);
    }
    switch (way_) {
      case 0:  // hangs
        return;
      case 1:  // as it should, with all that the scene allows
        give(servo, 1, 5, 0.4, 0.002);
        return;
      case 2:  // floods
        for (int i = 0; i < 20; ++i) give(servo, i % 2 == 0 ? 255 : 1e30, 1e4, 0.4, 0.002);
        return;
      case 3:  // no numbers
        give(servo, std::numeric_limits<double>::quiet_NaN(), 1, 0, 0);
        give(servo, 1, std::numeric_limits<double>::infinity(), 0, 0);
        return;
      case 4:  // shakes
        give(servo, servo.last().tick % 2 == 0 ? 50 : -50, 0, 0, 0);
        return;
      case 5:  // more than the scene allows
        give(servo, 1, 1, 1e9, 1e9);
        return;
      default:  // slow
        if (servo.last().tick % 15 == 0) give(servo, 2, 20, 0.4, 0);
    }
  }

 private:
  int below(int n) { return static_cast<int>(random_() % static_cast<std::uint32_t>(n)); }
  double any(double most) { return most * (below(2001) - 1000) / 1000; }
  void give(kerf::Servo& servo, double force_n, double goal_mm, double k, double b) {
    servo.give_force({.force_n = {any(force_n), any(force_n), any(force_n)},
                      .goal_mm = {any(goal_mm), any(goal_mm), any(goal_mm)},
                      .stiffness_n_per_mm = k,
                      .damping_ns_per_mm = b});
  }

  std::mt19937 random_;
  int way_ = 0, left_ = 0;
};

double length(const float (&v)[3]) {
  return std::hypot(static_cast<double>(v[0]), static_cast<double>(v[1]),
                    static_cast<double>(v[2]));
}

}  // namespace

TEST_CASE("no program breaks a limit of any device, also if the device has faults") {
  constexpr double kPeakN = 2, kSlewN = 0.5, kRoundingN = 1e-3;
  const std::array<std::string, 4> faults{"", "silence.toml", "lost_long.toml",
                                          "jumping_encoder.toml"};
  for (const char* device : {"omni", "falcon", "woodenhaptics", "inverse3", "touch", "omega"}) {
    CAPTURE(std::string(device));
    const auto scene = kerf::Scene::load(kScenes + "/external.toml",
                                         {std::string("device.personality=\"") + device + "\"",
                                          "limits.slew_n_per_ms=0.5", "force.unchecked_gain=true"});
    double rendered_n = 0;
    for (int seed = 0; seed < kSeeds; ++seed) {
      CAPTURE(seed);
      const std::string& fault = faults[static_cast<std::size_t>(seed) % faults.size()];
      kerf::Servo servo(scene);
      kerf::Hand hand(scene, kScenes + "/hands/touch.toml",
                      fault.empty() ? "" : kScenes + "/../hil/faults/" + fault);
      Program program(static_cast<std::uint32_t>(seed));
      std::array<float, 3> last{};
      std::uint64_t broken = 0;
      for (int i = 0; i < kTicks; ++i) {
        program.turn(servo);
        const kerf::TickRecord& tick = servo.step(hand.next(servo.last()));
        const double now_n = length(tick.commanded_force_n);
        float change[3];
        double before_n = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          change[axis] = tick.commanded_force_n[axis] - last[axis];
          before_n = std::hypot(before_n, static_cast<double>(last[axis]));
          last[axis] = tick.commanded_force_n[axis];
        }
        const bool on = (tick.flags & kerf::kFlagMotorsOn) != 0;
        const bool off_is_off = on || (now_n == 0 && tick.dac_counts[0] == 0 &&
                                       tick.dac_counts[1] == 0 && tick.dac_counts[2] == 0);
        const bool fault_is_off = tick.fault == 0 || !on;
        const bool within = std::isfinite(now_n) && now_n <= kPeakN;
        const bool smooth = !on || length(change) <= std::max(kSlewN, before_n) + kRoundingN;
        broken += off_is_off && fault_is_off && within && smooth ? 0 : 1;
        rendered_n = std::max(rendered_n, now_n);
      }
      CHECK(broken == 0);
    }
    CHECK(rendered_n > 1);
  }
}

}  // namespace kerf::external_faults_test
