// SPDX-License-Identifier: Apache-2.0
#include "controller/servo/kinematics.hpp"

#include <cmath>
#include <cstdint>
#include <memory>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "controller/plan/plan_device.hpp"
#include "controller/servo/sense.hpp"
#include "hil/device/omni.hpp"
#include "shared/wire/omni.hpp"

namespace kerf::kinematics_test {
namespace {

/// Joint angles inside the Omni's end stops.
JointVec<double> random_joints() {
  const auto between = [](double lo, double hi) {
    return lo + (hi - lo) * *rc::gen::inRange(0, 1'000'001) / 1e6;
  };
  const double thigh = between(0.0, 1.5);
  return {between(-0.98, 0.98), thigh, thigh + between(-0.8, 1.2)};
}

template <class N>
ForwardKinematics<N> omni_pose(const JointVec<double>& q) {
  using Real = typename N::Real;
  using Angle = typename N::Angle;
  return serial_arm_pose<N>({Real(omni::kUpperLinkMm), Real(omni::kForearmMm),
                             Real(omni::kOriginHeightMm), Real(omni::kOriginDepthMm)},
                            {Angle(q.x), Angle(q.y), Angle(q.z)});
}

template <class N>
double worst(const DeviceVec<typename N::Real>& a, const DeviceVec<double>& b) {
  return std::max(
      {std::abs(double(a.x) - b.x), std::abs(double(a.y) - b.y), std::abs(double(a.z) - b.z)});
}

}  // namespace

TEST_CASE_TEMPLATE("sine and cosine agree with the library over all that an angle can be", N,
                   FixedNumbers, DoubleNumbers) {
  for (int i = -8000; i <= 8000; ++i) {
    const auto angle = typename N::Angle(i / 1000.0);
    const double x = double(angle);
    // Beyond 2 rad a float adds twice what it lacks of pi (8.7e-8), and half a step at 5 rad.
    const double of_pi = sizeof(typename N::Unit) == 4 && std::abs(x) > 2 ? 4.2e-7 : 0;
    const double tolerance = sizeof(typename N::Unit) == 8 ? 2e-9 : 2.5e-7 + of_pi;
    const auto [sine, cosine] = sine_cosine<N>(angle);
    REQUIRE(std::abs(double(sine) - std::sin(x)) < tolerance);
    REQUIRE(std::abs(double(cosine) - std::cos(x)) < tolerance);
  }
}

TEST_CASE_TEMPLATE("the tip agrees with the emulator's own kinematics", N, FixedNumbers,
                   DoubleNumbers) {
  // A step of Q15.16 is 1.5e-5 mm; three roundings and the angle's add up to less than 2e-4.
  const double tolerance_mm = sizeof(typename N::Real) == 8 ? 1e-6 : 2e-4;
  const OmniArm arm;
  CHECK(rc::check([&] {
    const auto q = random_joints();
    RC_ASSERT(worst<N>(omni_pose<N>(q).tip_mm, arm.tip_mm(q)) < tolerance_mm);
  }));
}

TEST_CASE_TEMPLATE("torques push the tip with the commanded force, by the emulator's Jacobian", N,
                   FixedNumbers, DoubleNumbers) {
  const OmniArm arm;
  CHECK(rc::check([&] {
    const auto q = random_joints();
    RC_PRE(std::abs(std::sin(q.z - q.y)) <
           0.99);  // away from the stretched arm, where J is singular
    const auto component = [] { return *rc::gen::inRange(-3000, 3001) / 1000.0; };
    const DeviceVec<double> force{component(), component(), component()};
    using Real = typename N::Real;
    const auto torque = omni_pose<N>(q).jacobian_t_mm *
                        DeviceVec<Real>{Real(force.x), Real(force.y), Real(force.z)};
    const auto felt = arm.tip_force_n(q, {double(torque.x), double(torque.y), double(torque.z)});
    RC_ASSERT(std::abs(felt.x - force.x) < 2e-3);
    RC_ASSERT(std::abs(felt.y - force.y) < 2e-3);
    RC_ASSERT(std::abs(felt.z - force.z) < 2e-3);
  }));
}

TEST_CASE_TEMPLATE("orientations stay rotations, whatever counters and pots read", N, FixedNumbers,
                   DoubleNumbers) {
  const auto plan = std::make_unique<ServoPlan<N>>();
  plan_device<N>({}, *plan);
  CHECK(rc::check([&] {
    EncoderState encoders;
    for (std::int32_t& counts : encoders.unwrapped) counts = *rc::gen::arbitrary<std::int32_t>();
    GimbalFilter gimbal;
    constexpr std::uint32_t kMost = kMaxGimbalSamples * std::uint32_t{65535};
    for (std::uint32_t& sum : gimbal.sum) {
      sum = *rc::gen::oneOf(rc::gen::just(std::uint32_t{0}), rc::gen::just(kMost),
                            rc::gen::inRange<std::uint32_t>(0, kMost));
    }
    const auto r = device_pose<N>(plan->device, encoders, gimbal).rotation;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        double product = 0;
        for (std::size_t k = 0; k < 3; ++k) product += double(r.row[i][k]) * double(r.row[j][k]);
        RC_ASSERT(std::abs(product - (i == j ? 1.0 : 0.0)) < 1e-6);
      }
    }
  }));
}

TEST_CASE("a straight gimbal and arm leave the tool's shaft upright") {
  const auto r = omni_orientation<DoubleNumbers>({0.0, 0.5, 0.0}, {0.0, 0.0, 0.0});
  CHECK(r.row[1][1] == doctest::Approx(1.0));
  // A turret turned to the left carries the tool's x axis towards the user's side.
  const auto left = omni_orientation<DoubleNumbers>({0.5, 0.5, 0.0}, {0.0, 0.0, 0.0});
  CHECK(left.row[0][2] == doctest::Approx(-std::sin(0.5)));
}

TEST_CASE("gimbal pots read their centre when both wipers are equal, and nothing when dead") {
  const auto centred =
      omni_gimbal<FixedNumbers>({0x8000, 0x8000, 0x8000}, {0x8000, 0x8000, 0x8000});
  const auto dead = omni_gimbal<FixedNumbers>({0, 0, 0}, {0, 0, 0});
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(std::abs(double(centred[i])) < 1e-6);
    CHECK(double(dead[i]) == 0.0);
  }
}

}  // namespace kerf::kinematics_test
