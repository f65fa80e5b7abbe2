// SPDX-License-Identifier: Apache-2.0
// The three device models: what holds for all of them, then calibration, counts and packets of
// each.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "hil/device/falcon.hpp"
#include "hil/device/hand.hpp"
#include "hil/device/omni.hpp"
#include "hil/device/wooden.hpp"
#include "hil/script/hand_script_file.hpp"
#include "tests/hil/model_runs.hpp"

namespace kerf::models_test {
namespace {

using kerf::test::at;
using kerf::test::kSecond;
using kerf::test::push;
using kerf::test::run;

/// Torque of a motor count or mA at the joints.
constexpr JointVec<double> kOmniNmm{0.342, 0.342, 0.342};
constexpr JointVec<double> kFalconNmm{-0.1, -0.1, -0.1};
constexpr JointVec<double> kWoodenNmm{0.0259 * 16, 0.0259 * 12, 0.0259 * 12};  // kt, capstans

/// Commands the counts of a wanted tip force, anywhere within `reach_mm`.
template <class Model>
void check_force(JointVec<double> nmm_per_count, double reach_mm) {
  CHECK(rc::check([&] {
    Model model;
    const DeviceVec<double> target = kerf::test::any_in_ball(reach_mm);
    run(model, at(target), kSecond);
    const auto newtons = [] { return *rc::gen::inRange(-15, 16) * 0.1; };
    const DeviceVec<double> wanted{newtons(), newtons(), newtons()};
    const JointVec<double> torque =
        kerf::test::torque_by_differences(model.arm(), model.joints_rad(), wanted);
    const auto count = [](double nmm, double per_count) {
      return static_cast<std::int16_t>(std::lround(nmm / per_count));
    };
    push(model, {count(torque.x, nmm_per_count.x), count(torque.y, nmm_per_count.y),
                 count(torque.z, nmm_per_count.z)});
    model.step(at(target));
    // Half a count on each joint, and the little that the tip moves in one bus cycle.
    const JointVec<double> error = kerf::test::torque_by_differences(
        model.arm(), model.joints_rad(), model.motor_force_n() - wanted);
    RC_ASSERT(std::abs(error.x) <= std::abs(nmm_per_count.x) / 2 + 2e-2);
    RC_ASSERT(std::abs(error.y) <= std::abs(nmm_per_count.y) / 2 + 2e-2);
    RC_ASSERT(std::abs(error.z) <= std::abs(nmm_per_count.z) / 2 + 2e-2);
  }));
}

/// If the host is silent for 100 ms, the last torque is held or dropped.
template <class Model, class Params>
void check_silence() {
  for (const auto policy : {kerf::OnSilence::hold_torque, kerf::OnSilence::drop_torque}) {
    Params params;
    params.on_silence = policy;
    Model model(params);
    for (int round = 0; round < 2; ++round) {
      push(model, {100, 100, 100});
      run(model, {}, 800);
      CHECK(norm(model.motor_force_n()) > 0);
      run(model, {}, 10);
      CHECK((norm(model.motor_force_n()) > 0) == (policy == kerf::OnSilence::hold_torque));
    }
  }
}

constexpr double kSlackRad = 1e-9;
bool within_stops(const OmniModel& model) {
  const auto q = model.joints_rad();
  return std::abs(q.x) < 0.98 + kSlackRad && q.y > -kSlackRad && q.y < 1.75 + kSlackRad &&
         q.z - q.y > -0.81 - kSlackRad && q.z - q.y < 1.25 + kSlackRad;
}
bool within_stops(const FalconModel& model) {
  return norm(model.tip_mm()) < kerf::falcon::kReachMm + 1e-9;
}
bool within_stops(const WoodenModel& model) {
  const auto q = model.joints_rad();
  return std::abs(q.x) < 1.0 + kSlackRad && q.y > -0.35 - kSlackRad && q.y < 1.35 + kSlackRad &&
         q.y + q.z > 0.45 - kSlackRad && q.y + q.z < 2.6 + kSlackRad;
}

template <class Model>
void check_jumps() {
  CHECK(rc::check([] {
    Model model;
    for (int jump = 0; jump < 4; ++jump) {
      const auto goal = at(kerf::test::any_in_ball(600));
      for (int cycle = 0; cycle < kSecond / 4; ++cycle) {
        model.step(goal);
        RC_ASSERT(within_stops(model));
        // A jump of 1.2 m gives (b + sqrt(k m)) d / m at most, through damper and spring.
        RC_ASSERT(norm(model.velocity_mm_per_s()) < 170'000);
      }
    }
  }));
}

bool reaches(const kerf::OmniArm& arm, DeviceVec<double> tip_mm) {
  return arm.within_limits(arm.joints_rad(tip_mm));
}
bool reaches(const kerf::FalconArm& /*arm*/, DeviceVec<double> tip_mm) {
  return kerf::FalconArm::within_limits(tip_mm);
}
bool reaches(const kerf::WoodenArm& arm, DeviceVec<double> tip_mm) {
  return arm.within_limits(arm.joints_rad(tip_mm));
}

/// Every script of the project stays in the arm's reach, moves without jumps, comes from above and
/// touches a half-space.
template <class Model>
void check_scripts() {
  const Model model;
  for (const std::string name : {"approach", "touch", "slide", "cut_cavity", "jerk"}) {
    CAPTURE(name);
    kerf::HandMotion motion(kerf::read_hand_script(KERF_HANDS "/" + name + ".toml"), model.route());
    bool in_reach = true;
    motion.calibrate();
    for (int i = 0; i < kSecond; ++i) in_reach &= reaches(model.arm(), motion.next().target_mm);
    motion.leave();
    auto last = motion.next().target_mm;
    double fastest = 0, fastest_on_the_way = 0, lowest = 25, highest = 0, lowest_on_the_way = 25;
    for (int i = 0; i < 20 * kSecond; ++i) {
      const bool on_the_way = !motion.arrived();
      const auto target = motion.next().target_mm;
      in_reach &= reaches(model.arm(), target);
      double& fastest_here = on_the_way ? fastest_on_the_way : fastest;
      fastest_here = std::max(fastest_here, norm(target - last) * kSecond);
      last = target;
      if (on_the_way && target.z > -25) lowest_on_the_way = std::min(lowest_on_the_way, target.y);
      if (!on_the_way) lowest = std::min(lowest, target.y);
      if (!on_the_way) highest = std::max(highest, target.y);
    }
    CHECK(in_reach);
    CHECK(fastest_on_the_way < kerf::ReachCurve::kMaxMmPerS);
    CHECK(lowest_on_the_way > 3);  // comes from above, clear of the surface
    CHECK(highest < 21);
    CHECK(lowest > -4);
    CHECK((lowest < 1) == (name != "approach"));  // a ball of radius 1 touches
    CHECK(fastest < (name == "jerk" ? 1100 : 500));
    if (name == "jerk") CHECK(fastest > 800);
  }
}

}  // namespace

TEST_CASE("motor counts give the commanded force within half a count") {
  check_force<OmniModel>(kOmniNmm, 30);
  check_force<FalconModel>(kFalconNmm, 40);
  check_force<WoodenModel>(kWoodenNmm, 60);
}

TEST_CASE("if host packets stop, the last torque is held, or dropped after 100 ms") {
  check_silence<OmniModel, OmniParams>();
  check_silence<FalconModel, FalconParams>();
}

TEST_CASE("no jump of a hand takes an arm out of its end stops") {
  check_jumps<OmniModel>();
  check_jumps<FalconModel>();
  check_jumps<WoodenModel>();
}

TEST_CASE("every script of the project stays in the reach of each arm and moves without jumps") {
  check_scripts<OmniModel>();
  check_scripts<FalconModel>();
  check_scripts<WoodenModel>();
}

}  // namespace kerf::models_test
