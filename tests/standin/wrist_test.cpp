// SPDX-License-Identifier: Apache-2.0
#include "standin/hd/wrist.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <random>

#include <doctest/doctest.h>

#include "standin/hd/motor_heat.hpp"
#include "standin/hd/touch_kinematics.hpp"

namespace kerf::wrist_test {

using namespace kerf::hd;  // NOLINT(google-build-using-namespace)

namespace {

constexpr double kTickS = 0.001;
constexpr double kPi = 3.14159265358979323846;

double distance(const Matrix3& a, const Matrix3& b) {
  double most = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) most = std::max(most, std::abs(a[i][j] - b[i][j]));
  }
  return most;
}

double step(const Angles& a, const Angles& b) {
  return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])});
}

bool is_in_range(const Angles& gimbal) {
  return std::abs(gimbal[0]) <= 2.45 && std::abs(gimbal[1]) <= 1.23 && std::abs(gimbal[2]) <= 2.38;
}

/// A wrist that is led tick by tick: in range, and no faster than it may be.
struct Led {
  Wrist wrist;
  bool has_begun = false;
  double fastest = 0;

  void to(const Matrix3& rotation, const Angles& joints) {
    const Angles before = wrist.angles();
    wrist.follow(rotation, joints, kTickS);
    CHECK(is_in_range(wrist.angles()));
    if (has_begun) fastest = std::max(fastest, step(wrist.angles(), before));
    has_begun = true;
  }
};

constexpr std::array<double, 4> kUpright{0, 0, 0, 1};

}  // namespace

TEST_CASE("an orientation within reach has its own gimbal angles") {
  const Angles joints = joint_angles({20, 10, -15});
  for (const Angles& gimbal : {Angles{0, 0, 0}, Angles{2.4, -1.2, 2.3}, Angles{-2.4, 1.2, -2.3},
                               Angles{0.3, 0.9, -1}, Angles{-1, -0.4, 0.2}}) {
    Wrist wrist;
    wrist.follow(wrist_rotation(joints, gimbal), joints, kTickS);
    CHECK(step(wrist.angles(), gimbal) < 1e-9);
  }
}

TEST_CASE("an upright stylus comes out of the inkwell without a jump of its gimbal") {
  // In the inkwell the forearm hangs down, and the upright stylus is parallel to the yaw's axis.
  Led led;
  const Matrix3 upright = stylus_rotation(kUpright);
  Angles joints{};
  for (int tick = 0; tick <= 2000; ++tick) {
    const double way = tick / 2000.0;
    const double side = 20 * std::sin(40 * way);  // past both sides of the turret's middle
    const DeviceVec<double> tip{side, -110 + 110 * way, -35 + 45 * way};
    joints = joint_angles(tip);
    led.to(upright, joints);
  }
  CHECK(led.fastest < 0.018 + 1e-12);
  CHECK(led.fastest < 0.01);  // it follows, and does not swing
  CHECK(distance(wrist_rotation(joints, led.wrist.angles()), upright) < 1e-9);  // in reach again
}

TEST_CASE("a stylus that is led over the singularity turns with its wrist") {
  const Angles joints = joint_angles({0, 0, 0});
  Led led;
  double jump = 0;
  Angles before{};
  for (int tick = 0; tick <= 4000; ++tick) {
    const double pitch = 0.5 + (2 * kPi - 1) / 2 * tick / 4000.0;  // beyond a quarter turn
    const Matrix3 there = wrist_rotation(joints, {0.01, pitch, 0.02});
    const Angles exact = angles_of(wrist_frame(there, joints));
    if (tick > 0) jump = std::max(jump, step(exact, before));
    before = exact;
    led.to(there, joints);
  }
  CHECK(jump > 3);  // of the decomposition
  CHECK(led.fastest < 0.018 + 1e-12);
}

TEST_CASE("beyond a stop the wrist rests at it, and finds back from the other side") {
  const Angles joints = joint_angles({0, 0, 0});
  Led led;
  for (int tick = 0; tick <= 5000; ++tick) {  // one turn and a half of the yaw
    led.to(wrist_rotation(joints, {3 * kPi * tick / 5000.0, 0.3, 0}), joints);
  }
  const Matrix3 there = wrist_rotation(joints, {-2.0, 0.3, 0});
  for (int tick = 0; tick < 1000; ++tick) led.to(there, joints);
  CHECK(step(led.wrist.angles(), {-2.0, 0.3, 0}) < 1e-9);
  CHECK(led.fastest < 0.018 + 1e-12);
}

TEST_CASE("out of reach the stylus is as near as the stops allow") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-kPi, kPi);
  const auto trace = [](const Matrix3& a, const Matrix3& b) {
    double sum = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) sum += a[i][j] * b[i][j];
    }
    return sum;
  };
  for (int round = 0; round < 100; ++round) {
    const Angles joints{any(random) / 4, 0.5 + any(random) / 8, any(random) / 8};
    const Matrix3 wanted = wrist_rotation(joints, {any(random), any(random), any(random)});
    Wrist wrist;
    for (int tick = 0; tick < 200; ++tick) wrist.follow(wanted, joints, 1);
    const double reached = trace(wrist_rotation(joints, wrist.angles()), wanted);
    for (std::size_t i = 0; i < 3; ++i) {
      for (const double turn : {-1e-3, 1e-3}) {
        Angles other = wrist.angles();
        other[i] += turn;
        if (is_in_range(other))
          CHECK(trace(wrist_rotation(joints, other), wanted) < reached + 1e-9);
      }
    }
  }
}

TEST_CASE("joints and gimbal give the tool its orientation again") {
  for (const Angles& gimbal : {Angles{0, 0, 0}, Angles{1, -0.4, 0.7}, Angles{-2.4, 1.2, -2.3}}) {
    const Angles joints = joint_angles({30, -20, 25});
    const auto q = tool_orientation(joints, gimbal);
    CHECK(distance(stylus_rotation(q), wrist_rotation(joints, gimbal)) < 1e-12);
  }
}

TEST_CASE("encoders count by the scales of the clients, from the inkwell and the middle") {
  CHECK(encoder_counts({}, {}) == std::array<double, 6>{0, 0, 0, 2048, 2048, 2048});
  constexpr double kDegree = kPi / 180;
  const auto counts = encoder_counts({24 * kDegree, 12 * kDegree, -2.4 * kDegree},
                                     {7.35 * kDegree, -73.5 * kDegree, 0.735 * kDegree});
  CHECK(counts == std::array<double, 6>{1000, -500, -100, 2148, 1048, 2058});
  for (const double most : encoder_counts({}, Wrist::kMostRad)) CHECK(most <= 4095);
}

TEST_CASE("the torques of a force are those that give it") {
  const Angles joints = joint_angles({30, 20, 10});
  const DeviceVec<double> force_n{0.7, -1.1, 0.4};
  const DeviceVec<double> again = force_of_torques(joints, torques_of_force(joints, force_n));
  CHECK(norm(again - force_n) < 1e-9);
}

TEST_CASE("a motor warms up by the square of its torque, and cools down") {
  // All joints at 0, the links at right angles: x loads the turret, y the thigh, z the shin.
  const Angles joints{};
  MotorHeat heat;
  const auto run = [&](DeviceVec<double> force_n, double seconds) {
    for (int tick = 0; tick < seconds / kTickS; ++tick) heat.heat_up(joints, force_n, kTickS);
  };
  run({0, 0, 0.88}, 12);
  CHECK(heat.temperatures()[0] == 0);
  CHECK(heat.temperatures()[1] == 0);
  CHECK(std::abs(heat.temperatures()[2] - (1 - std::exp(-1.0))) < 1e-6);
  run({0.88, 0, 0}, 12);  // the turret; the shin cools
  CHECK(std::abs(heat.temperatures()[0] - (1 - std::exp(-1.0))) < 1e-6);
  CHECK(std::abs(heat.temperatures()[2] - (1 - std::exp(-1.0)) * std::exp(-1.0)) < 1e-6);
  run({0, 3.3, 0}, 60);  // 14 times as much as it may give for ever
  CHECK(heat.temperatures()[1] == 1);
  CHECK(heat.hottest() > 13);
  run({}, 120);
  CHECK(heat.hottest() < 1e-3);
}

}  // namespace kerf::wrist_test
