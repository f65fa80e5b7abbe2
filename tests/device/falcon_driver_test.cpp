// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstdint>

#include <doctest/doctest.h>

#include "controller/device/device_driver.hpp"
#include "shared/wire/falcon.hpp"
#include "tests/device/fake_port.hpp"

using kerf::FalconCommand;
using kerf::FalconReport;
using kerf::Phase;
using kerf::test::FakePort;

namespace {

constexpr std::array<bool, 3> kHomed{true, true, true};

kerf::ServoOutput forcing() {
  kerf::ServoOutput output;
  output.motor_counts = {1000, -1000, 4095};
  output.motors_on = true;
  output.phase = Phase::active;
  return output;
}

FalconCommand last_sent(const FakePort& port) {
  REQUIRE_FALSE(port.sent.empty());
  const auto command = kerf::falcon::decode_command(port.sent.back());
  REQUIRE(command);
  return *command;
}

}  // namespace

TEST_CASE("falcon: the host begins, with the motors off") {
  FakePort port;
  kerf::FalconDriver driver(port);
  driver.start();
  REQUIRE(port.sent.size() == 1);
  CHECK(last_sent(port) == FalconCommand{});
}

TEST_CASE("falcon: every tick leaves a command; what switches the motors off goes out of turn") {
  FakePort port;
  kerf::FalconDriver driver(port);
  driver.start();
  CHECK(port.sent_now == 1);
  driver.command(forcing());
  driver.command(forcing());
  CHECK(port.sent.size() == 3);
  CHECK(port.sent_now == 1);
  driver.command({});
  CHECK(port.sent_now == 2);
  CHECK(last_sent(port).motor == std::array<std::int16_t, 3>{});
  driver.command({});
  CHECK(port.sent.size() == 5);
  CHECK(port.sent_now == 2);
}

TEST_CASE("falcon: a release by another thread in the middle of a command has the last word") {
  FakePort port;
  kerf::FalconDriver driver(port);
  port.before_send = [&] {
    port.before_send = nullptr;
    CHECK(driver.release_for_good());
  };
  driver.command(forcing());
  REQUIRE(port.sent.size() == 3);
  CHECK(last_sent(port).motor == std::array<std::int16_t, 3>{});
}

TEST_CASE("falcon: reports carry counts, buttons and homing of all three axes") {
  FakePort port;
  kerf::FalconDriver driver(port);
  port.push(kerf::encode(FalconReport{
      .encoder = {512, -3, -512}, .buttons = kerf::falcon::kButtonCentre, .homed = kHomed}));
  const auto report = driver.read();
  CHECK(report.encoder == std::array<std::int16_t, 3>{512, -3, -512});
  CHECK(report.parked);
  CHECK(report.homed);
  port.push(kerf::encode(
      FalconReport{.buttons = kerf::falcon::kButtonForward, .homed = {true, false, true}}));
  const auto later = driver.read();
  CHECK(later.button1);
  CHECK_FALSE(later.parked);
  CHECK_FALSE(later.homed);
  CHECK(later.counter == report.counter + 1);
}

TEST_CASE("falcon: asks for homing until it is homed; lights tell the phase") {
  FakePort port;
  kerf::FalconDriver driver(port);
  driver.command({});
  CHECK(last_sent(port).homing);
  CHECK(last_sent(port).blue);
  port.push(kerf::encode(FalconReport{.homed = kHomed}));
  static_cast<void>(driver.read());
  driver.command(forcing());
  CHECK(last_sent(port) == FalconCommand{.motor = {1000, -1000, 4095}, .green = true});
  port.push(kerf::encode(FalconReport{.homed = kHomed}));
  static_cast<void>(driver.read());
  kerf::ServoOutput fault;
  fault.phase = Phase::fault;
  driver.command(fault);
  CHECK(last_sent(port) == FalconCommand{.red = true});
}

TEST_CASE("falcon: split, short and garbled packets are refused") {
  FakePort port;
  kerf::FalconDriver driver(port);
  auto bytes = kerf::encode(FalconReport{.homed = kHomed});
  port.push(std::span(bytes).first(15));
  bytes[15] = 'x';
  port.push(bytes);
  CHECK_FALSE(driver.read().fresh);
  CHECK(driver.refused() == 2);
}

TEST_CASE("falcon: released for good, every later command is neutral") {
  FakePort port;
  kerf::FalconDriver driver(port);
  CHECK(driver.release_for_good());
  port.push(kerf::encode(FalconReport{.homed = kHomed}));
  static_cast<void>(driver.read());
  driver.command(forcing());
  CHECK(last_sent(port).motor == std::array<std::int16_t, 3>{});
}
