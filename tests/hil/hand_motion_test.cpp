// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <doctest/doctest.h>

#include "hil/device/falcon.hpp"
#include "hil/device/hand.hpp"
#include "hil/device/omni.hpp"
#include "hil/device/wooden.hpp"
#include "hil/script/hand_script_file.hpp"

namespace {

using kerf::DeviceVec;
using kerf::HandGoal;
using kerf::HandMotion;

constexpr int kSecond = kerf::omni::kBusCyclesPerSecond;
const DeviceVec<double> kDock{0, -70, -86};

/// The Omni's way, from another inkwell.
kerf::HandRoute from_dock() {
  kerf::HandRoute route = kerf::OmniModel().route();
  route.rest_tip_mm = kDock;
  return route;
}

HandMotion motion_of(const std::string& script) {
  HandMotion motion(kerf::parse_hand_script(script, "test"), from_dock());
  motion.leave();
  return motion;
}

HandGoal after(HandMotion& motion, int cycles) {
  HandGoal goal;
  for (int i = 0; i < cycles; ++i) goal = motion.next();
  return goal;
}

/// Its last wish on the way to the start.
HandGoal reach(HandMotion& motion) {
  HandGoal goal;
  for (int i = 0; i < kSecond && !motion.arrived(); ++i) goal = motion.next();
  REQUIRE(motion.arrived());
  return goal;
}

double distance(DeviceVec<double> a, DeviceVec<double> b) {
  return norm(a - b);
}

}  // namespace

TEST_CASE("the hand rests in the inkwell until it leaves, then reaches for the start") {
  HandMotion motion(kerf::parse_hand_script("start_mm = [1, 4, 2]\n[[step]]\nhold = 1", "test"),
                    from_dock());
  CHECK(after(motion, 100).in_inkwell);
  motion.leave();
  const auto first = motion.next();
  CHECK_FALSE(first.in_inkwell);
  CHECK(distance(first.target_mm, kDock) < 0.01);
  CHECK_FALSE(motion.arrived());
  CHECK(distance(reach(motion).target_mm, {1, 4, 2}) < 1e-12);
}

TEST_CASE("a smooth move is half way at half time, a linear one everywhere in proportion") {
  auto motion = motion_of(
      "start_mm = [0, 4, 0]\n"
      "[[step]]\nmove_mm = [0, 0, 8]\nseconds = 1\n"
      "[[step]]\nmove_mm = [8, 0, 8]\nseconds = 1\nease = 'linear'");
  reach(motion);
  CHECK(distance(after(motion, kSecond / 4).target_mm,
                 {0, 4 * (1 - 0.103515625), 8 * 0.103515625}) < 1e-9);
  CHECK(distance(after(motion, kSecond / 4).target_mm, {0, 2, 4}) < 1e-9);
  after(motion, kSecond / 2);
  CHECK(distance(after(motion, kSecond / 4).target_mm, {2, 0, 8}) < 1e-9);
}

TEST_CASE("patterns stay in their size, end where they began, and sink as told") {
  auto motion = motion_of(
      "start_mm = [0, 4, 0]\n"
      "[[step]]\ncircle_mm = 2\nturns = 3\nseconds = 1\nsink_mm = 1\n"
      "[[step]]\nzigzag_mm = [3, 4]\nturns = 5\nseconds = 1\nsink_mm = 0.5\n"
      "[[step]]\nhold = 1");
  reach(motion);
  double circle_mm = 0;
  HandGoal goal;
  for (int i = 0; i < kSecond; ++i) {
    goal = motion.next();
    circle_mm = std::max(circle_mm, std::hypot(goal.target_mm.x, goal.target_mm.z));
  }
  CHECK(circle_mm == doctest::Approx(2.0));
  CHECK(distance(goal.target_mm, {0, 3, 0}) < 1e-9);
  double width = 0;
  double depth = 0;
  for (int i = 0; i < kSecond; ++i) {
    goal = motion.next();
    width = std::max(width, std::abs(goal.target_mm.x));
    depth = std::max(depth, std::abs(goal.target_mm.z));
  }
  CHECK(width == doctest::Approx(1.5).epsilon(1e-4));
  CHECK(depth == doctest::Approx(2.0).epsilon(1e-4));
  CHECK(distance(goal.target_mm, {0, 2.5, 0}) < 1e-9);
  CHECK(distance(after(motion, 10 * kSecond).target_mm, {0, 2.5, 0}) < 1e-9);
}

TEST_CASE("the unit scales every length of the script and none of the way out") {
  kerf::HandScript script = kerf::parse_hand_script(
      "start_mm = [1, 2, 0]\n[[step]]\nmove_mm = [0, -1, 0]\nseconds = 1", "test");
  script.unit_mm = 3;
  HandMotion motion(script, from_dock());
  motion.leave();
  CHECK(distance(motion.next().target_mm, kDock) < 0.01);
  CHECK(distance(reach(motion).target_mm, {3, 6, 0}) < 1e-9);
  CHECK(distance(after(motion, kSecond).target_mm, {0, -3, 0}) < 1e-9);
}

TEST_CASE("a hand that rests again after its script has ended can calibrate and leave anew") {
  kerf::HandRoute route = from_dock();
  route.calibration = {kerf::hand_move(kDock + DeviceVec<double>{0, 5, 0}, 0.1),
                       kerf::hand_move(kDock, 0.1)};
  HandMotion motion(kerf::parse_hand_script("start_mm = [1, 4, 2]\n[[step]]\nhold = 1", "test"),
                    route);
  motion.leave();
  static_cast<void>(after(motion, 3 * kSecond));
  REQUIRE(motion.ended());
  motion.rest();
  motion.calibrate();
  CHECK(distance(after(motion, kSecond / 10).target_mm, kDock + DeviceVec<double>{0, 5, 0}) < 1e-9);
  CHECK(distance(after(motion, kSecond / 10).target_mm, kDock) < 1e-9);
  motion.leave();
  static_cast<void>(after(motion, 3 * kSecond));
  CHECK(motion.ended());
}

TEST_CASE("the repeated block comes again to the cycle, and the orientation is kept") {
  auto motion = motion_of(
      "[[step]]\nmove_mm = [0, 3, 0]\nseconds = 0.5\norientation_deg = [0, 30, 0]\n"
      "[[step]]\nrepeat = true\nmove_mm = [2, 3, 0]\nseconds = 0.25\nbutton = 2\n"
      "[[step]]\nmove_mm = [0, 3, 0]\nseconds = 0.25");
  reach(motion);
  after(motion, kSecond / 4);
  CHECK(motion.next().orientation_rad[1] > 0);
  after(motion, kSecond / 4 - 1);
  for (int round = 0; round < 100; ++round) {
    const auto out = after(motion, kSecond / 4);
    CHECK(distance(out.target_mm, {2, 3, 0}) < 1e-9);
    CHECK(out.button2);
    CHECK(out.orientation_rad[1] == doctest::Approx(kerf::omni::kPi / 6));
    const auto back = after(motion, kSecond / 4);
    CHECK(distance(back.target_mm, {0, 3, 0}) < 1e-9);
    CHECK_FALSE(back.button2);
  }
}

TEST_CASE("every script of the project stays in the arm's reach and moves without jumps") {
  const kerf::OmniModel omni;
  const auto& arm = omni.arm();
  for (const std::string name : {"approach", "touch", "slide", "cut_cavity", "jerk"}) {
    CAPTURE(name);
    HandMotion motion(kerf::read_hand_script(KERF_HANDS "/" + name + ".toml"), omni.route());
    motion.leave();
    auto last = omni.dock_tip_mm();
    double fastest = 0;
    double fastest_on_the_way = 0;
    double lowest_on_the_way = 25;
    double lowest = 25;
    double highest = 0;
    bool reachable = true;
    for (int i = 0; i < 25 * kSecond; ++i) {
      const bool on_the_way = !motion.arrived();
      const auto target = motion.next().target_mm;
      reachable &= arm.within_limits(arm.joints_rad(target));
      double& fastest_here = on_the_way ? fastest_on_the_way : fastest;
      fastest_here = std::max(fastest_here, norm(target - last) * kSecond);
      last = target;
      if (on_the_way && target.z > -25) lowest_on_the_way = std::min(lowest_on_the_way, target.y);
      if (!on_the_way) lowest = std::min(lowest, target.y);
      if (!on_the_way) highest = std::max(highest, target.y);
    }
    CHECK(reachable);
    CHECK(fastest_on_the_way < kerf::ReachCurve::kMaxMmPerS);
    CHECK(lowest_on_the_way > 3);  // comes from above, clear of the surface
    CHECK(highest < 21);
    CHECK(lowest > -4);
    CHECK((lowest < 1) == (name != "approach"));  // where a ball of radius 1 touches
    CHECK(fastest < (name == "jerk" ? 1100 : 500));
    if (name == "jerk") CHECK(fastest > 800);
  }
}

TEST_CASE("a reach keeps its bounds, and no lighter or stiffer hand than the bounds' is faster") {
  const kerf::HandRoute routes[] = {kerf::OmniModel().route(), kerf::FalconModel().route(),
                                    kerf::WoodenModel().route()};
  for (const kerf::HandRoute& route : routes) {
    const kerf::ReachCurve way = kerf::reach_curve(route, route.rest_tip_mm, {0, 5, 0});
    CHECK(distance(way.at(0), route.rest_tip_mm) < 1e-12);
    CHECK(distance(way.at(1), {0, 5, 0}) < 1e-12);
    CHECK(way.least_seconds(1000) == way.least_seconds(10'000));
    CHECK(way.least_seconds(5) == doctest::Approx(2 * way.least_seconds(10)));
  }
}

TEST_CASE("along a line the reach's duration is the closed form of least jerk") {
  kerf::HandRoute route;
  for (const double mm : {0.0, 0.5, 50.0, 200.0, 800.0}) {
    CAPTURE(mm);
    const kerf::ReachCurve way = kerf::reach_curve(route, {0, mm, 0}, {});
    for (const double w : {3.0, 30.0, 60.0, 1000.0}) {
      // Flash and Hogan: the peaks of speed, acceleration and jerk are 15/8, 10/sqrt(3) and 60.
      const double expected =
          std::max({15.0 / 8 * mm / 1000, std::sqrt(10 / std::sqrt(3.0) * mm / 10'000),
                    std::cbrt(60 * mm / 2) / w});
      CHECK(way.least_seconds(w) == doctest::Approx(expected).epsilon(0.02));
    }
  }
}

TEST_CASE("the tip of a soft and heavy hand swings past its start by no more than the bound") {
  for (const auto& [stiffness, mass] :
       {std::pair{0.5, 0.145}, {0.1, 0.145}, {0.05, 0.6}, {2.0, 0.1}}) {
    kerf::HandRoute route = from_dock();
    route.hand_rad_per_s = std::sqrt(1000 * stiffness / mass);
    HandMotion motion(kerf::parse_hand_script("start_mm = [0, 5, 0]\n[[step]]\nhold = 1", "test"),
                      route);
    motion.leave();
    DeviceVec<double> tip = kDock, velocity{};
    double lowest = 5;
    for (int i = 0; i < 6 * kSecond; ++i) {
      const DeviceVec<double> pull = motion.next().target_mm - tip;
      velocity = velocity + pull * (route.hand_rad_per_s * route.hand_rad_per_s / kSecond);
      tip = tip + velocity * (1.0 / kSecond);
      if (motion.arrived()) lowest = std::min(lowest, tip.y);
    }
    CAPTURE(stiffness);
    CHECK(lowest > 5 - kerf::ReachCurve::kSwingMm);
  }
}
