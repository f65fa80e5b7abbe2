// SPDX-License-Identifier: Apache-2.0
// The exchange between a vendor's frame and the page, in the time of the test.
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include <doctest/doctest.h>

#include "tests/arm/mock_library.hpp"

namespace kerf::exchange_test {

using kerf::test::Link;
using kerf::test::test_ns;
using Force = std::array<double, 3>;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t kMs = 1'000'000;
constexpr ArmReading kHomed{.homed = true};

}  // namespace

TEST_CASE("exchange: a reading goes out as a report, with the force of the frame before it") {
  Link link(Personality::touch);
  const ArmReading reading{.position_mm = {1.25, -100, 7},
                           .orientation = {0, 0, 1, 1},
                           .button1 = true,
                           .button2 = false,
                           .parked = true,
                           .homed = true};
  static_cast<void>(link.controller());
  CHECK(link.exchange.turn(reading) == Force{});
  link.command({100, -200, 300});
  CHECK(link.exchange.turn(reading) == Force{0.1, -0.2, 0.3});
  static_cast<void>(link.exchange.turn(reading));
  const auto report = link.report().value();
  CHECK(report.number == 3);
  CHECK(report.position_um == std::array<std::int32_t, 3>{1250, -100'000, 7000});
  CHECK(report.orientation == std::array<std::int16_t, 4>{0, 0, 23170, 23170});
  CHECK(report.force_mn == std::array<std::int16_t, 3>{100, -200, 300});
  CHECK((report.button1 && !report.button2 && report.parked && report.homed && report.powered));
}

TEST_CASE("exchange: a command gives its force for less than 20 ms, whoever has stopped") {
  Link link(Personality::touch);
  const ArmReading reading = kHomed;
  static_cast<void>(link.exchange.turn(reading));
  link.command({1000, 0, 0});
  const std::int64_t sent_ns = test_ns;
  int frames_with_force = 0;
  for (int ms = 0; ms < 100; ++ms, test_ns += kMs) {
    if (link.exchange.turn(reading) == Force{}) continue;
    ++frames_with_force;
    CHECK(test_ns - sent_ns < 19 * kMs);
  }
  CHECK(frames_with_force == 19);  // 0 to 18 ms: the frame at 19 ms is the first of zero force
  CHECK(link.exchange.counts().expired == 1);
  link.command({500, 0, 0});  // and the next controller is obeyed at once
  CHECK(link.exchange.turn(reading) == Force{0.5, 0, 0});
}

TEST_CASE("exchange: a command from the future, without force or after letting go gives none") {
  Link link(Personality::touch);
  const ArmReading reading = kHomed;
  static_cast<void>(link.exchange.turn(reading));
  test_ns += 2 * kMs;
  link.command({1000, 0, 0});
  test_ns -= 2 * kMs;
  CHECK(link.exchange.turn(reading) == Force{});
  test_ns += 2 * kMs;
  CHECK(link.exchange.turn(reading) == Force{1, 0, 0});
  link.command({1000, 0, 0}, false);
  CHECK(link.exchange.turn(reading) == Force{});
  link.command({1000, 0, 0});
  link.exchange.let_go();
  for (int ms = 0; ms < 20; ++ms, test_ns += kMs) {
    CHECK(link.exchange.turn(reading) == Force{});
    CHECK_FALSE(link.exchange.finished());
  }
  static_cast<void>(link.exchange.turn(reading));
  CHECK(link.exchange.finished());
  CHECK_FALSE(link.report()->powered);
}

TEST_CASE(
    "exchange: the end is 20 ms of zero force, whatever the library's rate, and three frames") {
  for (const int hz : {200, 500, 1000, 2000, 4000}) {
    CAPTURE(hz);
    Link link(Personality::touch);  // by its word of 1000
    link.exchange.let_go();
    const std::int64_t since_ns = test_ns;
    int frames = 0;
    for (; !link.exchange.finished(); ++frames, test_ns += kerf::kNsPerSecond / hz) {
      CHECK(link.exchange.turn(kHomed) == Force{});
    }
    CHECK(test_ns - since_ns == 20 * kMs + kerf::kNsPerSecond / hz);  // the last began after 20 ms
    CHECK(frames == 20 * hz / 1000 + 1);
  }
  Link slow(Personality::touch);
  slow.exchange.let_go();
  for (int frame = 0; frame < 3; ++frame, test_ns += 100 * kMs) {
    CHECK_FALSE(slow.exchange.finished());
    static_cast<void>(slow.exchange.turn(kHomed));
  }
  CHECK(slow.exchange.finished());
}

TEST_CASE("exchange: a command of any time that a page can hold, and its ends, gives no force") {
  Link link(Personality::touch);
  static_cast<void>(link.exchange.turn(kHomed));
  using Limits = std::numeric_limits<std::int64_t>;
  const std::int64_t now_ns = test_ns;
  for (const std::int64_t at_ns :
       {Limits::min(), Limits::min() + 1, -now_ns, std::int64_t{-1}, std::int64_t{0},
        now_ns + 2 * kMs, Limits::max() - now_ns, Limits::max() - 1, Limits::max()}) {
    CAPTURE(at_ns);
    test_ns = at_ns;
    link.command({1000, 0, 0});
    test_ns = now_ns;
    CHECK(link.exchange.turn(kHomed) == Force{});
  }
  link.command({1000, 0, 0});
  CHECK(link.exchange.turn(kHomed) == Force{1, 0, 0});
}

TEST_CASE("exchange: no force is above the device's peak, and its direction stays") {
  Link touch(Personality::touch);
  static_cast<void>(touch.exchange.turn(kHomed));
  touch.command({32767, -32768, 32767});
  const Force force = touch.exchange.turn(kHomed);
  CHECK(std::hypot(force[0], force[1], force[2]) == doctest::Approx(3.3));
  CHECK(force[0] == doctest::Approx(1.905).epsilon(0.001));
  CHECK(force[1] == doctest::Approx(-1.905).epsilon(0.001));
  CHECK(touch.exchange.counts().clamped == 1);
}

TEST_CASE("exchange: a reading that is no pose is not published") {
  Link link(Personality::touch);
  static_cast<void>(link.controller());
  static_cast<void>(link.exchange.turn(kHomed));
  CHECK(link.report().has_value());
  ArmReading bad = kHomed;
  for (const double value : {kNaN, 1e308, -1e308, 1000.5, HUGE_VAL}) {
    bad.position_mm = {0, value, 0};
    static_cast<void>(link.exchange.turn(bad));
  }
  bad.position_mm = {};
  for (const double value : {kNaN, 1e308, HUGE_VAL}) {
    bad.orientation = {0, 0, 0, value};
    static_cast<void>(link.exchange.turn(bad));
  }
  bad.orientation = {};
  static_cast<void>(link.exchange.turn(bad));
  CHECK_FALSE(link.report().has_value());
  CHECK(link.exchange.counts().unreadable == 9);
  CHECK(link.exchange.frames() == 10);
}

TEST_CASE("exchange: before the first reading there is no force") {
  Link link(Personality::omega);
  link.command({1000, 0, 0});
  CHECK(link.exchange.turn(std::nullopt) == Force{});
  CHECK(link.exchange.turn(kHomed) == Force{1, 0, 0});
  CHECK(link.exchange.turn(std::nullopt) == Force{1, 0, 0});  // the servo decides how long
}

TEST_CASE("exchange: a reading that is not homed ends the force in its own frame") {
  Link link(Personality::touch);
  static_cast<void>(link.exchange.turn(kHomed));
  link.command({1000, 0, 0});
  CHECK(link.exchange.turn(kHomed) == Force{1, 0, 0});
  CHECK(link.exchange.turn(ArmReading{}) == Force{});
  CHECK(link.exchange.turn(std::nullopt) == Force{});
  CHECK(link.exchange.turn(kHomed) == Force{1, 0, 0});
}

TEST_CASE("exchange: the first failure stays, and ends the force") {
  Link link(Personality::touch);
  static_cast<void>(link.exchange.turn(kHomed));
  link.command({1000, 0, 0});
  link.exchange.fail(0x302);
  link.exchange.fail(0x300);
  CHECK(link.exchange.failure() == 0x302);
  CHECK(link.exchange.turn(kHomed) == Force{});
}

TEST_CASE("orientation: each quarter turn, and no mirror") {
  using V = std::array<double, 3>;
  const V x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  const auto minus = [](V v) { return V{-v[0], -v[1], -v[2]}; };
  const auto same = [](const std::optional<std::array<double, 4>>& q,
                       const std::array<double, 4>& wanted) {
    REQUIRE(q);
    double dot = 0;
    for (std::size_t i = 0; i < 4; ++i) dot += (*q)[i] * wanted[i];
    return std::abs(std::abs(dot) - 1) < 1e-12;
  };
  const double h = std::sqrt(0.5);
  CHECK(same(kerf::orientation_of(x, y, z), {0, 0, 0, 1}));
  CHECK(same(kerf::orientation_of(x, z, minus(y)), {h, 0, 0, h}));  // about x
  CHECK(same(kerf::orientation_of(minus(z), y, x), {0, h, 0, h}));  // about y
  CHECK(same(kerf::orientation_of(y, minus(x), z), {0, 0, h, h}));  // about z
  CHECK(same(kerf::orientation_of(x, minus(y), minus(z)), {1, 0, 0, 0}));
  CHECK(same(kerf::orientation_of(minus(x), y, minus(z)), {0, 1, 0, 0}));
  CHECK(same(kerf::orientation_of(minus(x), minus(y), z), {0, 0, 1, 0}));
  CHECK_FALSE(kerf::orientation_of(x, y, minus(z)));
  CHECK_FALSE(kerf::orientation_of({}, {}, {}));
  CHECK_FALSE(kerf::orientation_of(x, x, z));
  CHECK_FALSE(kerf::orientation_of({kNaN, 0, 0}, y, z));
  // Each pair out of square by 2.5 degrees, and by 3.5.
  const auto leant = [](double degrees, int off, int towards) {
    std::array<V, 3> axes{V{1, 0, 0}, V{0, 1, 0}, V{0, 0, 1}};
    const double angle = degrees * 3.14159265 / 180;
    V& axis = axes[static_cast<std::size_t>(off)];
    axis[static_cast<std::size_t>(off)] = std::cos(angle);
    axis[static_cast<std::size_t>(towards)] = std::sin(angle);
    return kerf::orientation_of(axes[0], axes[1], axes[2]);
  };
  for (const auto& [off, towards] : {std::pair{0, 1}, {1, 0}, {1, 2}, {2, 1}, {2, 0}, {0, 2}}) {
    CAPTURE(off);
    CAPTURE(towards);
    CHECK(leant(2.5, off, towards));
    CHECK_FALSE(leant(3.5, off, towards));
  }
  CHECK_FALSE(kerf::orientation_of({1.03, 0, 0}, y, z));
  CHECK(kerf::orientation_of({1.02, 0, 0}, y, z));
}

}  // namespace kerf::exchange_test
