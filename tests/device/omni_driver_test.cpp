// SPDX-License-Identifier: Apache-2.0
#include <cstdint>

#include <doctest/doctest.h>

#include "controller/device/device_driver.hpp"
#include "shared/wire/omni.hpp"
#include "tests/device/fake_port.hpp"

namespace {

using kerf::test::FakePort;

void push(FakePort& port, std::uint32_t counter, std::int16_t encoder = 0) {
  port.push(kerf::encode(kerf::OmniReport{.encoder = {encoder, 0, 0}, .counter = counter}));
}

}  // namespace

TEST_CASE("the newest of several waiting reports counts") {
  FakePort port;
  kerf::OmniDriver driver(port);
  push(port, 1, 10);
  push(port, 2, 20);
  push(port, 3, 30);
  const auto report = driver.read();
  CHECK(report.fresh);
  CHECK(report.encoder[0] == 30);
  CHECK(driver.lost() == 0);
}

TEST_CASE("no packet: the report is not fresh") {
  FakePort port;
  kerf::OmniDriver driver(port);
  CHECK_FALSE(driver.read().fresh);
  push(port, 1);
  CHECK(driver.read().fresh);
  CHECK_FALSE(driver.read().fresh);
}

TEST_CASE("losses are counted by the device's counter, also over its wrap") {
  FakePort port;
  kerf::OmniDriver driver(port);
  push(port, 0xfffffffe);
  push(port, 3);  // 0xffffffff, 0, 1, 2 are missing
  CHECK(driver.read().fresh);
  CHECK(driver.lost() == 4);
}

TEST_CASE("an old or repeated packet does not move the tip back") {
  FakePort port;
  kerf::OmniDriver driver(port);
  push(port, 10, 100);
  push(port, 9, 90);
  push(port, 10, 91);
  CHECK(driver.read().encoder[0] == 100);
  CHECK(driver.refused() == 2);
  CHECK(driver.lost() == 0);
}

TEST_CASE("a counter with a wrong bit is refused once, and nothing is lost by it") {
  for (const int bit : {8, 13, 20, 30, 31}) {
    CAPTURE(bit);
    FakePort port;
    kerf::OmniDriver driver(port);
    for (const std::uint32_t counter : {500U, 501U, 502U ^ (1U << bit), 503U, 504U}) {
      push(port, counter, static_cast<std::int16_t>(counter % 1000));
    }
    CHECK(driver.read().encoder[0] == 504);
    CHECK(driver.refused() == 1);
    CHECK(driver.lost() == 1);  // 502, which cannot be told
  }
}

TEST_CASE("a device that counts anew is believed at its second packet") {
  FakePort port;
  kerf::OmniDriver driver(port);
  push(port, 0x80000000, 10);
  push(port, 1, 20);
  CHECK(driver.read().encoder[0] == 10);
  push(port, 2, 30);
  CHECK(driver.read().encoder[0] == 30);
  CHECK(driver.lost() == 0);
}

TEST_CASE("a long gap is counted when its end is believed, and no more than a device can be away") {
  FakePort port;
  kerf::OmniDriver driver(port);
  for (const std::uint32_t counter : {1U, 5002U, 5003U}) push(port, counter);
  static_cast<void>(driver.read());
  CHECK(driver.lost() == 5000);
  for (const std::uint32_t counter : {1'005'003U, 1'005'004U}) push(port, counter);
  CHECK(driver.read().fresh);
  CHECK(driver.lost() == 5000);
}

TEST_CASE("truncated and overlong packets are refused, not read as reports") {
  FakePort port;
  kerf::OmniDriver driver(port);
  port.incoming.emplace_back(43);
  port.incoming.emplace_back(45);
  port.incoming.emplace_back(1500);
  CHECK_FALSE(driver.read().fresh);
  CHECK(driver.refused() == 3);
}

TEST_CASE("a flood of packets is bounded work") {
  FakePort port;
  for (std::uint32_t counter = 1; counter <= 1000; ++counter) push(port, counter);
  kerf::OmniDriver driver(port);
  CHECK(driver.read().fresh);
  CHECK(port.receive_calls <= 64);
}

TEST_CASE("commands carry counts, motors and light; release is neutral with motors off") {
  FakePort port;
  kerf::OmniDriver driver(port);
  kerf::ServoOutput output;
  output.motor_counts = {100, -200, 300};
  output.motors_on = true;
  output.phase = kerf::Phase::active;
  driver.command(output);
  driver.release();
  REQUIRE(port.sent.size() == 2);
  const auto command = kerf::decode_command(port.sent[0]);
  REQUIRE(command);
  CHECK(command->motor == output.motor_counts);
  CHECK(command->motors_on);
  CHECK(command->light == kerf::OmniCommand::Light::steady);
  const auto released = kerf::decode_command(port.sent[1]);
  REQUIRE(released);
  CHECK(*released == kerf::OmniCommand{});
}
