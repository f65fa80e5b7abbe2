// SPDX-License-Identifier: Apache-2.0
// The emulated Cartesian devices: kerf's own packets, as shared/wire/cartesian.hpp draws them, and
// the vendors' figures: the product pages of Inverse3 and omega.3, the Touch's configuration file
// and the documents of OpenHaptics.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <doctest/doctest.h>

#include "hil/device/cartesian.hpp"
#include "tests/hil/bytes_of_models.hpp"

namespace kerf::published_cartesian_test {
namespace {

using namespace kerf::test;  // NOLINT(google-build-using-namespace)

struct Figures {
  kerf::Personality personality;
  double peak_n;      ///< Touch: the vendor's configuration; Inverse3: 10 N peak; omega.3: 12 N
  int quantum_um;     ///< 0.055 mm; 0.01 mm; 0.01 mm
  Three reach_mm;     ///< half of the workspace; of the Touch more than the data sheet's
  bool is_published;  ///< this workspace is the vendor's own
};
// Inverse3: 510 x 460 x 230 mm, height, width, depth. omega.3: 160 mm in diameter, 110 mm along the
// axis to the user.
const Figures kCartesian[] = {{kerf::Personality::touch, 3.3, 55, {80, 60, 35}, false},
                              {kerf::Personality::inverse3, 10, 10, {230, 255, 115}, true},
                              {kerf::Personality::omega, 12, 10, {80, 80, 55}, true}};

int i32(const Bytes& bytes, std::size_t where) {
  return static_cast<int>(static_cast<unsigned>(u16(bytes, where)) |
                          static_cast<unsigned>(u16(bytes, where + 2)) << 16);
}
Bytes push_mn(std::array<int, 3> mn) {
  Bytes bytes{'k', 'c', 'c', '1'};
  for (const int one : mn) {
    bytes.push_back(static_cast<std::uint8_t>(one));
    bytes.push_back(static_cast<std::uint8_t>(one >> 8));
  }
  bytes.insert(bytes.end(), {1, 1, 0, 0, 0, 0});
  return bytes;
}

}  // namespace

TEST_CASE(
    "cartesian: micrometres in steps of the vendor's resolution, and a workspace of the vendor's "
    "size") {
  for (const Figures& figures : kCartesian) {
    CAPTURE(word_of(figures.personality));
    kerf::CartesianModel model{kerf::CartesianParams(figures.personality)};
    run(model, at({11.11, -7.77, 3.33}), 1000 * kMs);
    const Bytes bytes = packet_of(model);
    const DeviceVec<double> tip = model.tip_mm();
    const Three truth{tip.x, tip.y, tip.z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int um = i32(bytes, 8 + 4 * axis);
      CHECK(um % figures.quantum_um == 0);
      CHECK(truth[axis] * 1000 - um >= 0);
      CHECK(truth[axis] * 1000 - um < figures.quantum_um);
    }
    for (const double side : {-1.0, 1.0}) {
      run(model, at({side * 400, side * 400, side * 400}), 2000 * kMs);
      const auto end = model.tip_mm() * side;
      const Three& most = figures.reach_mm;
      CHECK(end.x >= most[0] - 1e-9);
      CHECK(end.y >= most[1] - 1e-9);
      CHECK(end.z >= most[2] - 1e-9);
      if (figures.is_published) CHECK(distance(end, {most[0], most[1], most[2]}) < 1e-9);
    }
  }
}

TEST_CASE(
    "cartesian: a force in mN along the same axis, and no more than the vendor's peak in any "
    "direction") {
  for (const Figures& figures : kCartesian) {
    CAPTURE(word_of(figures.personality));
    kerf::CartesianModel model{kerf::CartesianParams(figures.personality)};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const int mn : {1500, -1500, 20'000}) {
        std::array<int, 3> force{};
        force[axis] = mn;
        REQUIRE(model.receive(push_mn(force)));
        run(model, at({0, 0, 0}), kMs);
        Three wanted{};
        wanted[axis] = std::min(mn / 1000.0, figures.peak_n);
        CHECK(distance(model.motor_force_n(), {wanted[0], wanted[1], wanted[2]}) < 1e-9);
        CHECK(i16(packet_of(model), 28 + 2 * axis) == std::lround(1000 * wanted[axis]));
      }
    }
    REQUIRE(model.receive(push_mn({12'000, 12'000, 12'000})));
    run(model, at({0, 0, 0}), kMs);
    CHECK(norm(model.motor_force_n()) == doctest::Approx(figures.peak_n));
  }
}

TEST_CASE("cartesian: a Touch rests in its inkwell at 0, -110, -35 mm, all joints at zero") {
  kerf::CartesianModel model{kerf::CartesianParams(kerf::Personality::touch)};
  model.step({});
  const Bytes bytes = packet_of(model);
  CHECK(i32(bytes, 8) == 0);
  CHECK(std::abs(i32(bytes, 12) + 110'000) <= 55);
  CHECK(std::abs(i32(bytes, 16) + 35'000) <= 55);
  CHECK((bytes[35] & 1) == 1);
}

TEST_CASE(
    "cartesian: the wrist turns as OpenHaptics counts it: right, and clockwise seen from above, is "
    "plus") {
  // As a quaternion x, y, z, w, for an arm that points straight ahead. Turning right is about y
  // (up) by minus the angle; leaning the shaft to the user is about x; the roll is about the shaft.
  const double s = std::sin(0.25), c = std::cos(0.25);
  struct Case {
    Three angles;
    std::array<double, 4> xyzw;
  };
  const Case cases[] = {
      {{0.5, 0, 0}, {0, -s, 0, c}},
      {{-0.5, 0, 0}, {0, s, 0, c}},
      {{0, 0.5, 0}, {s, 0, 0, c}},
      {{0, 0, 0.5}, {0, s, 0, c}},
      // Yaw after pitch: (0, -s, 0, c) (s, 0, 0, c); pitch after roll: (s, 0, 0, c) (0, s, 0, c).
      {{0.5, 0.5, 0}, {s * c, -s * c, s * s, c * c}},
      {{0, 0.5, 0.5}, {s * c, s * c, s * s, c * c}}};
  for (const kerf::Personality personality :
       {kerf::Personality::touch, kerf::Personality::inverse3}) {
    kerf::CartesianModel model{kerf::CartesianParams(personality)};
    for (const Case& one : cases) {
      HandGoal goal = at({0, 0, 0});
      goal.orientation_rad = one.angles;
      run(model, goal, kMs);
      const Bytes bytes = packet_of(model);
      for (std::size_t i = 0; i < 4; ++i) {
        CHECK(i16(bytes, 20 + 2 * i) / 32767.0 ==
              doctest::Approx(one.xyzw[i]).epsilon(1e-3).scale(1));
      }
    }
  }
}

}  // namespace kerf::published_cartesian_test
