// SPDX-License-Identifier: Apache-2.0
// The emulated devices against figures that others have published, written out here as their
// sources have them: bytes in, bytes out, and the true tip. Nothing of kerf's own packets,
// kinematics or constants is used, so a mistake that both sides of kerf share is seen too.
//
// Sources: the open FireWire drivers of the Omni (raw_omni, libphantom) and its URDF; libnifalcon
// for the Falcon; the makers' haptikfabriken API for WoodenHaptics.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <doctest/doctest.h>

#include "hil/device/falcon.hpp"
#include "hil/device/omni.hpp"
#include "hil/device/wooden.hpp"
#include "tests/hil/bytes_of_models.hpp"

namespace kerf::published_test {
namespace {

using namespace kerf::test;  // NOLINT(google-build-using-namespace)

const DeviceVec<double> kPlaces[] = {{0, 0, 0}, {35, 20, -15}, {-40, -25, 10}, {10, 45, 25}};

// ---- PHANTOM Omni

/// 16 bytes of the host: words of 12 bits around 0x7FF, status 0x53C0 with bit 3 for the motors.
Bytes omni_command(std::array<int, 3> counts, bool on) {
  Bytes bytes(16, 0);
  for (std::size_t i = 0; i < 3; ++i) {
    const int word = 0x7FF + counts[i];
    bytes[2 * i] = static_cast<std::uint8_t>(word);
    bytes[2 * i + 1] = static_cast<std::uint8_t>(word >> 8);
  }
  bytes[6] = on ? 0xC8 : 0xC0;
  bytes[7] = 0x53;
  return bytes;
}
/// The joints, from 15000 counts a turn, docked at 0, 0.23 and -0.37 rad; the second encoder counts
/// down.
Three omni_joints(const Bytes& now, const Bytes& docked) {
  const auto turned = [&](std::size_t i) {
    const auto counts = static_cast<std::int16_t>(i16(now, 4 + 2 * i) - i16(docked, 4 + 2 * i));
    return counts * 2 * kPi / 15000;
  };
  return {turned(0), 0.23 - turned(1), -0.37 + turned(2)};
}
DeviceVec<double> omni_tip_mm(Three q) {
  const double r = 133.35 * std::cos(q[1]) + 133.35 * std::sin(q[2]);
  return {-std::sin(q[0]) * r, 133.35 * std::sin(q[1]) - 133.35 * std::cos(q[2]) + 23.35,
          std::cos(q[0]) * r - 168.35};
}

}  // namespace

TEST_CASE("omni: its bytes are those of the traces, and 0 says pressed and docked") {
  kerf::OmniModel model;
  model.step({});
  Bytes bytes = packet_of(model);
  REQUIRE(bytes.size() == 44);
  CHECK(u16(bytes, 0) == 0);
  CHECK(u16(bytes, 2) == 0x001E);
  CHECK(u16(bytes, 20) == 0x1007);
  CHECK((bytes[28] == 'F' && bytes[29] == 'W'));
  CHECK((bytes[19] & 7) == 3);  // bit 2 is 0: docked; both buttons up
  HandGoal goal = at({0, 5, 0});
  goal.button1 = true;
  run(model, goal, 1000 * kMs);
  bytes = packet_of(model);
  CHECK((bytes[19] & 7) == 6);
}

TEST_CASE("omni: encoders of 15000 counts a turn and links of 133.35 mm lead to the true tip") {
  kerf::OmniModel model;
  model.step({});
  const Bytes docked = packet_of(model);
  for (const DeviceVec<double>& place : kPlaces) {
    run(model, at(place), 1000 * kMs);
    const Three q = omni_joints(packet_of(model), docked);
    CHECK(distance(omni_tip_mm(q), model.tip_mm()) < 0.1);  // a count is 0.056 mm
    CHECK(distance(model.tip_mm(), place) < 1);             // where the hand has led it
  }
}

TEST_CASE("omni: gimbal angles by the pots' published lines") {
  kerf::OmniModel model;
  HandGoal goal = at({0, 5, 0});
  for (const Three& angles : {Three{0.3, -0.2, 1.1}, Three{-0.9, 0.4, -0.7}}) {
    goal.orientation_rad = angles;
    run(model, goal, 1000 * kMs);
    const Bytes bytes = packet_of(model);
    const auto ratio = [&](std::size_t i) {
      const double a = u16(bytes, 10 + 2 * i), b = u16(bytes, 22 + 2 * i);
      return a / (a + b);
    };
    CHECK(5.48 * ratio(0) - 2.74 == doctest::Approx(angles[0]).epsilon(1e-3));
    // Against the forearm, which leans outwards by q3: an upright shaft has the pitch q3.
    const double pitch = -5.28 * ratio(1) + 2.64 - model.joints_rad().z;
    CHECK(pitch == doctest::Approx(angles[1]).epsilon(1e-3));
    CHECK(4.76 * ratio(2) - 2.38 == doctest::Approx(angles[2]).epsilon(1e-3));
  }
}

TEST_CASE(
    "omni: a motor word above 0x7FF turns its joint up or left, 0.70 N m at the end of its range") {
  kerf::OmniModel model;
  run(model, at({15, 10, 5}), 1000 * kMs);
  for (std::size_t motor = 0; motor < 3; ++motor) {
    std::array<int, 3> counts{};
    counts[motor] = 1024;
    REQUIRE(model.receive(omni_command(counts, true)));
    model.step(at({15, 10, 5}));
    const DeviceVec<double> force_n = model.motor_force_n();
    // The work of the force along the joint, by differences of the published formula.
    const auto q = model.joints_rad();
    for (std::size_t joint = 0; joint < 3; ++joint) {
      Three more{q.x, q.y, q.z}, less = more;
      more[joint] += 1e-5;
      less[joint] -= 1e-5;
      const double torque_nmm = dot(force_n, omni_tip_mm(more) - omni_tip_mm(less)) / 2e-5;
      CHECK(torque_nmm ==
            doctest::Approx(joint == motor ? 700.0 / 2 : 0).epsilon(0.002).scale(100));
    }
  }
  REQUIRE(model.receive(omni_command({1024, 1024, 1024}, false)));
  model.step(at({15, 10, 5}));
  CHECK(norm(model.motor_force_n()) == 0);
}

TEST_CASE("omni: the tip moves like the 45 g of the data sheet under a known force") {
  kerf::OmniParams params;
  params.hand_stiffness_n_per_mm = 0.001;
  params.hand_damping_ns_per_mm = 0;
  params.hand_mass_kg = 0;
  params.viscous_ns_per_mm = 0;
  params.coulomb_n = 0;
  kerf::OmniModel model(params);
  run(model, at({0, 5, 0}), kMs);
  const DeviceVec<double> before = model.velocity_mm_per_s();
  REQUIRE(model.receive(omni_command({600, 0, 0}, true)));
  DeviceVec<double> impulse_ns;
  for (int i = 0; i < 2 * kMs; ++i) {
    model.step(at({0, 5, 0}));
    impulse_ns = impulse_ns + model.motor_force_n() * 125e-6;
  }
  const double gained_m_per_s = norm(model.velocity_mm_per_s() - before) / 1000;
  CHECK(norm(impulse_ns) / gained_m_per_s == doctest::Approx(0.045).epsilon(0.05).scale(0));
}

// ---- Novint Falcon

namespace {

/// <, three numbers of four nibbles, the lowest first, each + 'A'; info + 'A'; 'A'; >.
Bytes falcon_command(std::array<int, 3> counts, int info) {
  Bytes bytes{'<'};
  for (const int count : counts) {
    for (int nibble = 0; nibble < 4; ++nibble) {
      bytes.push_back(static_cast<std::uint8_t>('A' + ((count >> (4 * nibble)) & 15)));
    }
  }
  bytes.insert(bytes.end(), {static_cast<std::uint8_t>('A' + info), 'A', '>'});
  return bytes;
}
int falcon_count(const Bytes& bytes, std::size_t axis) {
  int value = 0;
  for (std::size_t i = 0; i < 4; ++i) value |= (bytes.at(1 + 4 * axis + i) - 'A') << (4 * i);
  return static_cast<std::int16_t>(value);
}
/// A packet a millisecond while the hand goes to a place; returns the last answer.
Bytes falcon_turns(DeviceModel& model, DeviceVec<double> place, std::array<int, 3> counts = {},
                   int turns = 1000) {
  Bytes last;
  for (int i = 0; i < turns; ++i) {
    REQUIRE(model.receive(falcon_command(counts, 1 | 2)));  // homing, green
    run(model, at(place), kMs);
    if (const Bytes now = packet_of(model); !now.empty()) last = now;
  }
  return last;
}
void home(DeviceModel& model) {
  falcon_turns(model, {0, 20, 35}, {}, 400);
  falcon_turns(model, {0, 20, -35}, {}, 400);
}

}  // namespace

TEST_CASE(
    "falcon: each leg closes at 35 degrees plus 0.036435 a count, with the published lengths") {
  kerf::FalconModel model;
  home(model);
  for (const DeviceVec<double>& place : {DeviceVec<double>{0, 0, 0}, DeviceVec<double>{18, -12, 8},
                                         DeviceVec<double>{-20, 15, -10}}) {
    const Bytes bytes = falcon_turns(model, place);
    REQUIRE(bytes.size() == 16);
    CHECK(((bytes[13] - 'A') >> 4) == 7);  // all three homed
    const DeviceVec<double> tip = model.tip_mm();
    CHECK(distance(tip, place) < 2);
    for (std::size_t leg = 0; leg < 3; ++leg) {
      const double azimuth = Three{105, -15, -135}[leg] * kPi / 180;
      const double t1 = (35 + 0.036435 * (falcon_count(bytes, leg) + 0.5)) * kPi / 180;
      // In the leg's frame, which stands at r, s; the grip is 125 mm in front of the hips.
      const double u = std::cos(azimuth) * tip.x + std::sin(azimuth) * tip.y - 40;
      const double v = std::cos(azimuth) * tip.y - std::sin(azimuth) * tip.x + 23.09;
      const double w = tip.z + 125;
      const double shin_mm = std::sqrt(102.5 * 102.5 - (v - 25) * (v - 25)) + 11.25 + 11.25;
      const double seen_mm = std::hypot(u + 14.43 - 60 * std::cos(t1), w - 60 * std::sin(t1));
      CHECK(std::abs(seen_mm - shin_mm) < 0.05);  // a count is 0.046 mm
    }
  }
}

TEST_CASE("falcon: centre is button 4, forward 2; the host's positive counts pull the grip in") {
  kerf::FalconModel model;
  HandGoal goal = at({0, 0, -15});
  goal.button1 = true;
  REQUIRE(model.receive(falcon_command({}, 2)));
  run(model, goal, 2 * kMs);
  CHECK(((packet_of(model).at(13) - 'A') & 15) == 4);
  goal.button1 = false;
  goal.button2 = true;
  REQUIRE(model.receive(falcon_command({}, 2)));
  run(model, goal, 2 * kMs);
  CHECK(((packet_of(model).at(13) - 'A') & 15) == 2);
  // The open driver sends 10^4 J^T F, negated, in N m: 0.1 N mm a count. 110 mm from the hips all
  // three thighs turn by 0.036435 degrees for 0.046 mm.
  run(model, at({0, 0, -15}), 1000 * kMs);
  REQUIRE(model.receive(falcon_command({1000, 1000, 1000}, 2)));
  model.step(at({0, 0, -15}));
  const DeviceVec<double> force_n = model.motor_force_n();
  CHECK(force_n.z == doctest::Approx(-3 * 100 * 0.036435 * kPi / 180 / 0.046).epsilon(0.02));
  CHECK(std::hypot(force_n.x, force_n.y) < 0.05);
}

// ---- WoodenHaptics

namespace {

Bytes words(std::array<int, 7> values) {
  Bytes bytes;
  for (const int value : values) {
    bytes.push_back(static_cast<std::uint8_t>(value));
    bytes.push_back(static_cast<std::uint8_t>(value >> 8));
  }
  return bytes;
}
/// Motors by 2000 counts a turn and capstans of 10 mm on bodies of 160, 120, 120 mm; links of 80,
/// 205 and 245 mm. The makers' x is to the user, y to the right, z up.
DeviceVec<double> wooden_tip_mm(Three angles) {
  const auto& [a, b, c] = angles;
  const double r = 205 * std::sin(b) + 245 * std::sin(c);
  return {std::sin(a) * r, 80 + 205 * std::cos(b) - 245 * std::cos(c) - 80, std::cos(a) * r - 220};
}
Three wooden_angles(const Bytes& bytes) {
  const Three body{160, 120, 120};
  Three angles{};
  for (std::size_t i = 0; i < 3; ++i)
    angles[i] = 2 * kPi * (i16(bytes, 2 * i) + 0.5) / 2000 * 10 / body[i];
  return angles;
}

}  // namespace

TEST_CASE("wooden: set to the home counts 0, 0, 6000, its counts lead to the true tip") {
  kerf::WoodenModel model;
  REQUIRE(model.receive(words({0, 0, 0, 1, 0, 0, 6000})));
  for (const DeviceVec<double>& place : kPlaces) {
    for (int i = 0; i < 1000; ++i) {
      REQUIRE(model.receive(words({})));
      run(model, at(place), kMs);
    }
    const Bytes bytes = packet_of(model);
    REQUIRE(bytes.size() == 14);
    CHECK(distance(wooden_tip_mm(wooden_angles(bytes)), model.tip_mm()) < 0.1);
    CHECK(distance(model.tip_mm(), place) < 2);
  }
}

TEST_CASE(
    "wooden: 25.9 N mm an ampere, geared by the capstan, towards higher counts; no force after "
    "half a second of silence") {
  for (std::size_t motor = 0; motor < 3; ++motor) {
    kerf::WoodenModel model;
    REQUIRE(model.receive(words({0, 0, 0, 1, 0, 0, 6000})));
    run(model, at({20, 10, 0}), 1000 * kMs);
    std::array<int, 7> out{};
    out[motor] = 1000;
    REQUIRE(model.receive(words(out)));
    model.step(at({20, 10, 0}));
    const auto q = model.joints_rad();
    for (std::size_t joint = 0; joint < 3; ++joint) {
      Three more{q.x, q.y, q.z}, less = more;
      more[joint] += 1e-5;
      less[joint] -= 1e-5;
      const double torque_nmm =
          dot(model.motor_force_n(), wooden_tip_mm(more) - wooden_tip_mm(less)) / 2e-5;
      const double wanted = joint == motor ? 25.9 * Three{16, 12, 12}[joint] : 0;
      CHECK(torque_nmm == doctest::Approx(wanted).epsilon(1e-3).scale(100));
    }
    run(model, at({20, 10, 0}), 495 * kMs);
    CHECK(norm(model.motor_force_n()) > 0.5);
    run(model, at({20, 10, 0}), 10 * kMs);
    CHECK(norm(model.motor_force_n()) == 0);
  }
}

}  // namespace kerf::published_test
