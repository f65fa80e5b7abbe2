// SPDX-License-Identifier: Apache-2.0
// What a driver remembers ends where it should: each in two cycles, and for long enough that a
// counter that goes on shows.
#include <array>
#include <cstdint>

#include <doctest/doctest.h>

#include "controller/device/device_driver.hpp"
#include "shared/wire/cartesian.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/omni.hpp"
#include "shared/wire/woodenhaptics.hpp"
#include "tests/device/fake_port.hpp"

namespace kerf::two_cycles_test {
namespace {

ServoOutput pushing(bool on) {
  ServoOutput out;
  out.motors_on = true;
  out.dac_counts = {static_cast<std::int16_t>(on ? 1 : 0), 0, 0};
  out.phase = Phase::active;
  return out;
}

/// An Omni or a Cartesian device: both number their packets.
template <class Driver>
struct Numbered {
  template <class... Arguments>
  explicit Numbered(const Arguments&... arguments) : driver(port, arguments...) {}
  void push(std::uint32_t number) {
    if constexpr (std::is_same_v<Driver, OmniDriver>) {
      port.push(encode(OmniReport{.encoder = {7, 0, 0}, .counter = number}));
    } else {
      CartesianReport report;
      report.number = number;
      port.push(encode(report));
    }
  }
  bool is_fresh() { return driver.read().fresh; }
  bool takes(std::uint32_t number) {
    push(number);
    return is_fresh();
  }

  test::FakePort port;
  Driver driver;
};

template <class Bench>
void check_numbers(Bench& bench) {
  REQUIRE(bench.takes(1000));
  // A wrong number is not believed by one that continues it after a right one came between.
  for (std::uint32_t cycle = 0; cycle < 3; ++cycle) {
    CHECK_FALSE(bench.takes(5000 + 2 * cycle));
    CHECK(bench.takes(1001 + cycle));
  }
  CHECK(bench.driver.lost() == 0);
  // A device that counts anew is believed after so many reads without a report, not in all.
  for (int cycle = 0; cycle < 3; ++cycle) {
    for (int i = 0; i < 100; ++i) REQUIRE_FALSE(bench.is_fresh());
    CHECK_FALSE(bench.takes(10));
    CHECK_FALSE(bench.takes(11));
    REQUIRE(bench.takes(static_cast<std::uint32_t>(1004 + cycle)));
  }
  for (std::uint32_t begin : {10U, 3U}) {
    for (int i = 0; i < 200; ++i) REQUIRE_FALSE(bench.is_fresh());
    CHECK_FALSE(bench.takes(begin));
    CHECK(bench.takes(begin + 1));
    CHECK(bench.takes(begin + 2));
    CHECK_FALSE(bench.takes(begin + 1));  // old
    CHECK(bench.takes(begin + 3));
  }
  CHECK(bench.driver.lost() == 0);
  CHECK(bench.takes(8));
  CHECK(bench.driver.lost() == 1);
}

}  // namespace

TEST_CASE("numbers: a wrong one is forgotten with the next right one, silence with a report") {
  Numbered<OmniDriver> omni;
  check_numbers(omni);
  Numbered<CartesianDriver> touch(1);
  check_numbers(touch);
}

TEST_CASE("falcon: standing still counts from the last change or push, and a second time alike") {
  test::FakePort port;
  FalconDriver driver(port);
  std::int16_t at = 0;
  const auto read = [&](bool push) {
    driver.command(pushing(push));
    port.push(encode(FalconReport{.encoder = {at, 0, 0}, .homed = {true, true, true}}));
    return driver.read().fresh;
  };
  for (int cycle = 0; cycle < 2; ++cycle) {
    CAPTURE(cycle);
    for (const bool moves : {true, false}) {  // a change, or a tick without a push, forgets it all
      for (int part = 0; part < 3; ++part) {
        for (int i = 0; i < 2900; ++i) REQUIRE(read(true));
        at = static_cast<std::int16_t>(at + (moves ? 1 : 0));
        REQUIRE(read(moves));
      }
    }
    at = static_cast<std::int16_t>(at + 1);
    REQUIRE(read(true));
    for (int i = 0; i < 3000; ++i) REQUIRE(read(true));
    REQUIRE_FALSE(read(true));
    REQUIRE_FALSE(read(false));  // while the force fades too
    at = static_cast<std::int16_t>(at + 1);
    REQUIRE(read(false));
  }
}

TEST_CASE("falcon: homing that is lost is asked for again, each time") {
  test::FakePort port;
  FalconDriver driver(port);
  for (int cycle = 0; cycle < 2; ++cycle) {
    for (const bool homed : {false, true, false, true}) {
      port.push(encode(FalconReport{.homed = {true, homed, true}}));
      CHECK(driver.read().homed == homed);
      driver.command({});
      CHECK(falcon::decode_command(port.sent.back()).value().homing == !homed);
    }
  }
}

TEST_CASE("wooden: home, leave, home again: each time as the first time") {
  test::FakePort port;
  WoodenDriver driver(port);
  const auto read = [&](std::array<std::int16_t, 3> encoder, bool button) {
    port.push(
        encode(WoodenReport{.encoder = {encoder[0], encoder[1], encoder[2]}, .calibrate = button}));
    const DeviceReport report = driver.read();
    driver.command({});
    return report;
  };
  const auto sets = [&] { return wooden::decode_command(port.sent.back()).value().set_encoders; };
  for (int cycle = 0; cycle < 3; ++cycle) {
    CAPTURE(cycle);
    const DeviceReport pressed = read({30, 200, 6100}, true);
    CHECK(pressed.parked);
    CHECK_FALSE(pressed.homed);
    CHECK(sets());
    CHECK(read({30, 200, 6100}, false).parked);  // not set yet
    CHECK_FALSE(sets());
    const DeviceReport at_home = read({0, 0, 6000}, false);
    CHECK(at_home.homed);
    CHECK(at_home.parked);
    CHECK(read({10, 0, 6000}, false).parked);
    CHECK_FALSE(read({300, 0, 6000}, false).parked);
    CHECK_FALSE(read({0, 0, 6000}, false).parked);  // through the pose in use
    CHECK(read({2000, 0, 6000}, true).homed);       // the button far from home parks alone
    CHECK_FALSE(read({2000, 0, 6000}, false).parked);
  }
}

TEST_CASE("wooden: a button far from home sets the encoders once, and again if it stays") {
  test::FakePort port;
  WoodenDriver driver(port);
  const auto sets = [&](std::array<std::int16_t, 3> encoder, bool button) {
    port.push(
        encode(WoodenReport{.encoder = {encoder[0], encoder[1], encoder[2]}, .calibrate = button}));
    static_cast<void>(driver.read());
    driver.command({});
    return wooden::decode_command(port.sent.back()).value().set_encoders;
  };
  static_cast<void>(sets({0, 0, 6000}, true));
  static_cast<void>(sets({0, 0, 6000}, false));
  // Readings that are off by 8 counts, of an arm that is set to them: each set adds 8 more.
  for (int press = 0; press < 2; ++press) {
    CAPTURE(press);
    std::int16_t off = 0;
    int count = 0;
    for (int i = 0; i < 64; ++i) {
      const auto set = sets({static_cast<std::int16_t>(2000 + off + 8), 0, 6000}, true);
      if (!set) continue;
      ++count;
      CHECK((*set)[0] == 2000 + off + 8);
      off = static_cast<std::int16_t>(off + 8);
    }
    CHECK(count == 1);
    CHECK(sets({2008, 0, 6000}, true));  // the set was lost
    CHECK_FALSE(sets({2008, 0, 6000}, false));
  }
}

TEST_CASE("a device that lets go sends out of turn each time it lets go, and no other time") {
  test::FakePort port;
  FalconDriver driver(port);
  for (int cycle = 1; cycle <= 3; ++cycle) {
    for (int i = 0; i < 5; ++i) driver.command(pushing(true));
    CHECK(port.sent_now == cycle - 1);
    for (int i = 0; i < 5; ++i) driver.command({});
    CHECK(port.sent_now == cycle);
  }
}

}  // namespace kerf::two_cycles_test
