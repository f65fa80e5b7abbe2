// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstdint>

#include <doctest/doctest.h>

#include "controller/device/device_driver.hpp"
#include "shared/wire/woodenhaptics.hpp"
#include "tests/device/fake_port.hpp"

using kerf::WoodenCommand;
using kerf::WoodenReport;
using kerf::test::FakePort;
namespace wooden = kerf::wooden;

namespace {

void push(FakePort& port, std::array<std::int16_t, 3> encoder, bool button = false,
          std::size_t bytes = wooden::kPacketBytes) {
  const auto packet = kerf::encode(
      WoodenReport{.encoder = {encoder[0], encoder[1], encoder[2]}, .calibrate = button});
  port.push(std::span(packet).first(bytes));
}

WoodenCommand last_sent(const FakePort& port) {
  REQUIRE_FALSE(port.sent.empty());
  const auto command = wooden::decode_command(port.sent.back());
  REQUIRE(command);
  return *command;
}

kerf::ServoOutput forcing() {
  kerf::ServoOutput output;
  output.motor_counts = {500, -500, 0};
  output.motors_on = true;
  output.phase = kerf::Phase::active;
  return output;
}

/// The button is pressed there, and the driver sends what the encoders are to be set to.
void press(FakePort& port, kerf::WoodenDriver& driver, std::array<std::int16_t, 3> encoder) {
  push(port, encoder, true);
  static_cast<void>(driver.read());
  driver.command({});
}
/// As after a press in the home pose that the device has heard.
void home(FakePort& port, kerf::WoodenDriver& driver) {
  press(port, driver, {0, 0, 0});
  push(port, {0, 0, 6000});
  REQUIRE(driver.read().homed);
}

}  // namespace

TEST_CASE("wooden: the host begins, with no current") {
  FakePort port;
  kerf::WoodenDriver driver(port);
  driver.start();
  CHECK(last_sent(port) == WoodenCommand{});
}

TEST_CASE("wooden: the button sets the encoders; the arm is parked until it leaves the pose") {
  FakePort port;
  kerf::WoodenDriver driver(port);
  push(port, {123, -45, 678});
  CHECK_FALSE(driver.read().homed);  // counts since power-up mean nothing

  push(port, {123, -45, 678}, true);
  CHECK(driver.read().parked);
  driver.command({});
  const std::array<std::int16_t, 6> home{0, 0, 6000, 0, 0, 0};
  CHECK(last_sent(port).set_encoders == home);

  push(port, {124, -45, 678}, true);  // the device has not heard it yet
  CHECK_FALSE(driver.read().homed);
  driver.command({});

  push(port, {1, 0, 5999});
  auto report = driver.read();
  CHECK(report.homed);
  CHECK(report.parked);
  driver.command(forcing());
  CHECK(last_sent(port) == WoodenCommand{.milliamps = {500, -500, 0}, .set_encoders = {}});

  push(port, {300, 0, 5999});
  CHECK_FALSE(driver.read().parked);
  push(port, {0, 0, 6000});  // through the pose again: that does not park
  report = driver.read();
  CHECK_FALSE(report.parked);
  CHECK(report.homed);
}

TEST_CASE("wooden: the button in use parks, and keeps the encoders as they are") {
  FakePort port;
  kerf::WoodenDriver driver(port);
  home(port, driver);
  push(port, {400, 1000, 5000});
  CHECK_FALSE(driver.read().parked);
  push(port, {400, 1000, 5000}, true);
  const auto pressed = driver.read();
  CHECK(pressed.parked);
  CHECK(pressed.homed);
  driver.command({});
  const std::array<std::int16_t, 6> as_they_are{400, 1000, 5000, 0, 0, 0};
  CHECK(last_sent(port).set_encoders == as_they_are);
  push(port, {400, 1000, 5000});
  const auto released = driver.read();
  CHECK_FALSE(released.parked);
  CHECK(released.homed);
}

TEST_CASE("wooden: an encoder of the other sign is turned with its motor and its home") {
  FakePort port;
  kerf::WoodenDriver driver(port, {1, -1, -1});
  press(port, driver, {30, -40, 50});
  const std::array<std::int16_t, 6> home{0, 0, -6000, 0, 0, 0};
  CHECK(last_sent(port).set_encoders == home);
  push(port, {0, 0, -6000});
  CHECK(driver.read().homed);
  push(port, {400, 1000, -32768});
  const std::array<std::int16_t, 3> joints{400, -1000, -32768};  // wraps
  CHECK(driver.read().encoder == joints);
  driver.command(forcing());
  const std::array<std::int16_t, 3> currents{500, 500, 0};
  CHECK(last_sent(port).milliamps == currents);
  // In use its counts are kept as they came.
  push(port, {400, 1000, -5000}, true);
  static_cast<void>(driver.read());
  driver.command({});
  const std::array<std::int16_t, 6> as_they_are{400, 1000, -5000, 0, 0, 0};
  CHECK(last_sent(port).set_encoders == as_they_are);
}

TEST_CASE("wooden: near home the button calibrates again") {
  FakePort port;
  kerf::WoodenDriver driver(port);
  home(port, driver);
  push(port, {30, 200, 6100}, true);  // slipped: home reads like this now
  CHECK_FALSE(driver.read().homed);
  driver.command({});
  const std::array<std::int16_t, 6> home{0, 0, 6000, 0, 0, 0};
  CHECK(last_sent(port).set_encoders == home);
}

TEST_CASE("wooden: counts that are not those of home after setting are no homing") {
  FakePort port;
  kerf::WoodenDriver driver(port);
  press(port, driver, {10, 20, 30});
  push(port, {10, 20, 30});  // the firmware let the button go and set nothing
  CHECK_FALSE(driver.read().homed);
}

TEST_CASE("wooden: packets are as long as the device's own") {
  FakePort port;
  kerf::WoodenDriver driver(port);
  driver.command({});
  CHECK(port.sent.back().size() == wooden::kPacketBytes);
  push(port, {0, 0, 0}, false, wooden::kLongPacketBytes);
  CHECK(driver.read().fresh);
  driver.command({});
  CHECK(port.sent.back().size() == wooden::kLongPacketBytes);
  port.incoming.emplace_back(13);
  port.incoming.emplace_back(65);
  CHECK_FALSE(driver.read().fresh);
  CHECK(driver.refused() == 2);
}
