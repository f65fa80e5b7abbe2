// SPDX-License-Identifier: Apache-2.0
#include <numbers>

#include <doctest/doctest.h>

#include "controller/kernel/proxy/contact_space.hpp"
#include "tests/rig/geometry.hpp"

namespace kerf::tool_turn_test {

using namespace kerf::extremes;

namespace {

constexpr double kPi = std::numbers::pi;

template <class N>
double angle_between(const Orientation<N>& a, const Orientation<N>& b) {
  const Orientation<N> rest = compose(a, inverse(b));
  const double sine = length({double(rest.x), double(rest.y), double(rest.z)});
  return 2 * std::atan2(sine, std::abs(double(rest.w)));
}

template <class N>
constexpr double kFine = N::kIsFixed ? 1e-7 : 1e-12;

}  // namespace

TEST_CASE_TEMPLATE("a turn and its matrix are the same rotation, at any angle", N, FixedNumbers,
                   DoubleNumbers) {
  RandomNumbers random(3);
  for (int i = 0; i < 2000; ++i) {
    const auto orientation = random.rotation<N>(i < 20 ? kPi : random.uniform(0, 2 * kPi));
    CHECK(angle_between(orientation_of<N>(rows_of(orientation)), orientation) < kFine<N>);
  }
}

TEST_CASE("a quarter about z takes x to y") {
  const double half = std::sqrt(0.5);
  const auto rows = rows_of(Orientation<DoubleNumbers>{0, 0, half, half});
  CHECK(rows[1][0] == doctest::Approx(1));
  CHECK(rows[0][1] == doctest::Approx(-1));
  CHECK(rows[2][2] == doctest::Approx(1));
}

TEST_CASE_TEMPLATE("a tool turns the short way by its step, and arrives", N, FixedNumbers,
                   DoubleNumbers) {
  RandomNumbers random(4);
  const double half_sine = 0.05, step = 2 * std::asin(half_sine);
  for (int i = 0; i < 200; ++i) {
    auto now = random.rotation<N>(random.uniform(0, kPi));
    const auto goal = random.rotation<N>(random.uniform(0, kPi));
    double rest = angle_between(goal, now);
    for (int k = 0; k < 40 && !(now == goal); ++k) {
      const auto next = rotate_towards(now, goal, typename N::Unit(half_sine));
      CHECK(angle_between(next, now) < step + kFine<N>);
      if (!(next == goal)) CHECK(angle_between(goal, next) == doctest::Approx(rest - step));
      now = next;
      rest = angle_between(goal, now);
    }
    CHECK(now == goal);
  }
}

TEST_CASE_TEMPLATE("a turn keeps its length through a million products", N, FixedNumbers,
                   DoubleNumbers) {
  RandomNumbers random(5);
  const auto little = random.rotation<N>(0.37);
  Orientation<N> orientation;
  for (int i = 0; i < 1'000'000; ++i) orientation = compose(little, orientation);
  const double square = double(orientation.x) * double(orientation.x) +
                        double(orientation.y) * double(orientation.y) +
                        double(orientation.z) * double(orientation.z) +
                        double(orientation.w) * double(orientation.w);
  CHECK(std::abs(square - 1) < (sizeof(typename N::Unit) == 4 ? 1e-6 : 1e-12));
}

}  // namespace kerf::tool_turn_test
