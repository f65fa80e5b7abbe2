// SPDX-License-Identifier: Apache-2.0
// The drivers above a bus in memory.
#include <array>
#include <cmath>
#include <cstdint>

#include <doctest/doctest.h>

#include "controller/device/device_driver.hpp"
#include "shared/wire/cartesian.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/omni.hpp"
#include "shared/wire/woodenhaptics.hpp"
#include "tests/device/fake_port.hpp"

namespace kerf::drivers_test {
namespace {

using Counts = std::array<std::int16_t, 3>;
using Encoders = std::array<std::int16_t, 6>;
constexpr std::array<bool, 3> kHomed{true, true, true};
constexpr Encoders kHome{0, 0, 6000, 0, 0, 0};

template <class Driver>
struct Bench {
  template <class... Arguments>
  explicit Bench(const Arguments&... arguments) : driver(port, arguments...) {}

  void push(std::uint32_t counter, std::int16_t encoder = 0) {
    port.push(kerf::encode(kerf::OmniReport{.encoder = {encoder, 0, 0}, .counter = counter}));
  }
  kerf::DeviceReport receive(const FalconReport& report) {
    port.push(kerf::encode(report));
    return driver.read();
  }
  kerf::DeviceReport read(Counts encoder, bool button = false,
                          std::size_t bytes = wooden::kPacketBytes) {
    const auto packet = kerf::encode(
        WoodenReport{.encoder = {encoder[0], encoder[1], encoder[2]}, .calibrate = button});
    port.push(std::span(packet).first(bytes));
    return driver.read();
  }
  /// As after a press of the button in the home pose that the device has received.
  void home() {
    static_cast<void>(read({0, 0, 0}, true));
    driver.command({});
    REQUIRE(read({0, 0, 6000}).homed);
  }
  [[nodiscard]] const std::vector<std::uint8_t>& last() const {
    REQUIRE_FALSE(port.sent.empty());
    return port.sent.back();
  }
  [[nodiscard]] OmniCommand omni() const { return kerf::decode_command(last()).value(); }
  [[nodiscard]] FalconCommand falcon() const {
    return kerf::falcon::decode_command(last()).value();
  }
  [[nodiscard]] WoodenCommand arm() const { return wooden::decode_command(last()).value(); }
  /// The encoder values that the next command sets.
  [[nodiscard]] Encoders encoders_set() {
    driver.command({});
    return arm().set_encoders.value();
  }

  kerf::test::FakePort port;
  Driver driver;
};
using Omni = Bench<kerf::OmniDriver>;
using Falcon = Bench<kerf::FalconDriver>;
using Wooden = Bench<kerf::WoodenDriver>;

kerf::ServoOutput forcing(Counts counts) {
  kerf::ServoOutput output;
  output.dac_counts = counts;
  output.motors_on = true;
  output.phase = kerf::Phase::active;
  return output;
}

}  // namespace

TEST_CASE("omni: the newest of several waiting reports counts, and none is not fresh") {
  Omni omni;
  CHECK_FALSE(omni.driver.read().fresh);
  for (const std::uint32_t counter : {1U, 2U, 3U}) {
    omni.push(counter, static_cast<std::int16_t>(10 * counter));
  }
  const auto report = omni.driver.read();
  CHECK(report.fresh);
  CHECK(report.counts[0] == 30);
  CHECK(omni.driver.lost() == 0);
  CHECK_FALSE(omni.driver.read().fresh);
}

TEST_CASE("omni: losses are counted by the device's counter, a long gap when its end is believed") {
  struct {
    std::vector<std::uint32_t> counters;
    std::uint64_t lost;
  } const cases[] = {
      {{0xfffffffe, 3}, 4},                       // over its wrap: 0xffffffff, 0, 1, 2
      {{1, 5002, 5003}, 5000},                    //
      {{500, 501, 502 ^ 1U << 8, 503, 504}, 1},   // a wrong bit: 502 is not known
      {{500, 501, 502 ^ 1U << 20, 503, 504}, 1},  //
      {{500, 501, 502 ^ 1U << 31, 503, 504}, 1},
  };
  for (const auto& [counters, lost] : cases) {
    CAPTURE(counters[1]);
    Omni omni;
    for (const std::uint32_t counter : counters) {
      omni.push(counter, static_cast<std::int16_t>(counter % 1000));
    }
    CHECK(omni.driver.read().counts[0] == counters.back() % 1000);
    CHECK(omni.driver.lost() == lost);
  }
}

TEST_CASE("omni: what counts elsewhere is believed after 20 ms of the fastest servo") {
  constexpr int kTicks = 160;
  for (const std::uint32_t begin : {600U, 1000U - 161, 1'000'000U, 0x80000000U}) {
    CAPTURE(begin);
    for (const int at_once : {1, begin < 1000 ? 1 : 60}) {  // however many come in a tick
      Omni omni;
      omni.push(1000, 1);
      CHECK(omni.driver.read().fresh);
      std::uint32_t counter = begin;
      for (int tick = 1; tick <= kTicks; ++tick) {
        for (int i = 0; i < at_once; ++i) omni.push(counter++, 2);
        REQUIRE_FALSE(omni.driver.read().fresh);
      }
      omni.push(counter, 3);
      CHECK(omni.driver.read().counts[0] == 3);
      CHECK(omni.driver.lost() == 0);
    }
  }
}

TEST_CASE("falcon and wooden: reports that stand still under torque are stale after 3 s") {
  Falcon falcon;
  Wooden arm;
  arm.home();
  const auto tick = [&](bool on) {
    falcon.driver.command(on ? forcing({1, 0, 0}) : forcing({}));
    arm.driver.command(on ? forcing({1, 0, 0}) : forcing({}));
    const bool fresh = falcon.receive({.encoder = {5, 6, 7}, .homed = kHomed}).fresh;
    CHECK(arm.read({300, 20, 5000}).fresh == fresh);
    return fresh;
  };
  for (int i = 0; i < 4000; ++i) REQUIRE(tick(false));  // no torque: a device may rest
  for (int i = 0; i < 3000; ++i) REQUIRE(tick(true));
  for (int i = 0; i < 20; ++i) REQUIRE_FALSE(tick(i < 19));  // while the force fades, and is none
  CHECK(falcon.driver.refused() == 20);
  CHECK(falcon.receive({.encoder = {5, 6, 8}, .homed = kHomed}).fresh);  // it lives
  CHECK(arm.read({301, 20, 5000}).fresh);
}

TEST_CASE("omni: an old or repeated packet does not move the tip back") {
  Omni omni;
  omni.push(10, 100);
  omni.push(9, 90);
  omni.push(10, 91);
  CHECK(omni.driver.read().counts[0] == 100);
  CHECK(omni.driver.refused() == 2);
  CHECK(omni.driver.lost() == 0);
}

TEST_CASE("truncated and overlong packets are refused, not read as reports") {
  Omni omni;
  const auto whole = kerf::encode(kerf::OmniReport{.encoder = {1, 2, 3}, .counter = 1});
  for (const std::size_t size : {43U, 45U, 1500U}) {  // each begins as a report does
    std::vector<std::uint8_t> packet(whole.begin(), whole.end());
    packet.resize(size);
    omni.port.push(packet);
  }
  CHECK_FALSE(omni.driver.read().fresh);
  CHECK(omni.driver.refused() == 3);
  Falcon falcon;
  auto bytes = kerf::encode(FalconReport{.homed = kHomed});
  falcon.port.push(std::span(bytes).first(15));
  bytes[15] = 'x';
  falcon.port.push(bytes);
  CHECK_FALSE(falcon.driver.read().fresh);
  CHECK(falcon.driver.refused() == 2);
}

TEST_CASE("a flood of packets is bounded work") {
  Omni omni;
  for (std::uint32_t counter = 1; counter <= 1000; ++counter) omni.push(counter);
  CHECK(omni.driver.read().fresh);
  CHECK(omni.port.receive_calls <= 64);
}

TEST_CASE("omni: commands carry counts, motors and light; release is neutral with motors off") {
  Omni omni;
  omni.driver.command(forcing({100, -200, 300}));
  CHECK(omni.omni() == OmniCommand{{100, -200, 300}, true, OmniCommand::Light::steady});
  omni.driver.release();
  CHECK(omni.omni() == OmniCommand{});
  CHECK(omni.port.sent.size() == 2);
}

TEST_CASE("falcon and wooden: the host begins, with the motors off") {
  Falcon falcon;
  falcon.driver.start();
  CHECK(falcon.port.sent.size() == 1);
  CHECK(falcon.falcon() == FalconCommand{});
  Wooden arm;
  arm.driver.start();
  CHECK(arm.arm() == WoodenCommand{});
}

TEST_CASE("falcon: every tick leaves a command; what switches the motors off goes out of turn") {
  Falcon falcon;
  falcon.driver.start();
  CHECK(falcon.port.sent_now == 1);
  falcon.driver.command(forcing({1000, -1000, 4095}));
  falcon.driver.command(forcing({1000, -1000, 4095}));
  CHECK(falcon.port.sent.size() == 3);
  CHECK(falcon.port.sent_now == 1);
  falcon.driver.command({});
  CHECK(falcon.port.sent_now == 2);
  CHECK(falcon.falcon().motor == Counts{});
  falcon.driver.command({});
  CHECK(falcon.port.sent.size() == 5);
  CHECK(falcon.port.sent_now == 2);
}

TEST_CASE("falcon: released for good, every later command is neutral, also one under way") {
  for (const bool under_way : {false, true}) {
    CAPTURE(under_way);
    Falcon falcon;
    if (under_way) {
      falcon.port.before_send = [&] {
        falcon.port.before_send = nullptr;
        CHECK(falcon.driver.release_for_good());
      };
    } else {
      CHECK(falcon.driver.release_for_good());
      static_cast<void>(falcon.receive({.homed = kHomed}));
    }
    falcon.driver.command(forcing({1000, -1000, 4095}));
    CHECK(falcon.falcon().motor == Counts{});
    if (under_way) CHECK(falcon.port.sent.size() == 3);
  }
}

TEST_CASE("falcon: reports carry counts, buttons and homing of all three axes") {
  Falcon falcon;
  const auto report = falcon.receive(
      {.encoder = {512, -3, -512}, .buttons = kerf::falcon::kButtonCentre, .homed = kHomed});
  CHECK(report.counts == Counts{512, -3, -512});
  CHECK(report.parked);
  CHECK(report.homed);
  const auto later =
      falcon.receive({.buttons = kerf::falcon::kButtonForward, .homed = {true, false, true}});
  CHECK(later.button1);
  CHECK_FALSE(later.parked);
  CHECK_FALSE(later.homed);
  CHECK(later.counter == report.counter + 1);
}

TEST_CASE("falcon: requests homing until it is homed; lights show the phase") {
  Falcon falcon;
  falcon.driver.command({});
  CHECK(falcon.falcon().homing);
  CHECK(falcon.falcon().blue);
  static_cast<void>(falcon.receive({.homed = kHomed}));
  falcon.driver.command(forcing({1000, -1000, 4095}));
  CHECK(falcon.falcon() == FalconCommand{.motor = {1000, -1000, 4095}, .green = true});
  static_cast<void>(falcon.receive({.homed = kHomed}));
  kerf::ServoOutput fault;
  fault.phase = kerf::Phase::fault;
  falcon.driver.command(fault);
  CHECK(falcon.falcon() == FalconCommand{.red = true});
}

TEST_CASE("wooden: the button sets the encoders; the arm is parked until it leaves the pose") {
  Wooden arm;
  CHECK_FALSE(arm.read({123, -45, 678}).homed);  // counts since power-up mean nothing
  CHECK(arm.read({123, -45, 678}, true).parked);
  CHECK(arm.encoders_set() == kHome);
  CHECK_FALSE(arm.read({124, -45, 678}, true).homed);  // the device has not received it yet
  arm.driver.command({});
  const auto at_home = arm.read({1, 0, 5999});
  CHECK(at_home.homed);
  CHECK(at_home.parked);
  arm.driver.command(forcing({500, -500, 0}));
  CHECK(arm.arm() == WoodenCommand{.milliamps = {500, -500, 0}, .set_encoders = {}});
  CHECK_FALSE(arm.read({300, 0, 5999}).parked);
  const auto through = arm.read({0, 0, 6000});  // the pose again: that does not park
  CHECK_FALSE(through.parked);
  CHECK(through.homed);
}

TEST_CASE("wooden: the button in use parks, and keeps the encoders as they are") {
  Wooden arm;
  arm.home();
  CHECK_FALSE(arm.read({400, 1000, 5000}).parked);
  const auto pressed = arm.read({400, 1000, 5000}, true);
  CHECK(pressed.parked);
  CHECK(pressed.homed);
  CHECK(arm.encoders_set() == Encoders{400, 1000, 5000, 0, 0, 0});
  const auto released = arm.read({400, 1000, 5000});
  CHECK_FALSE(released.parked);
  CHECK(released.homed);
}

TEST_CASE("wooden: an encoder of the other sign is turned with its motor and its home") {
  Wooden arm(std::array{1, -1, -1});
  static_cast<void>(arm.read({30, -40, 50}, true));
  CHECK(arm.encoders_set() == Encoders{0, 0, -6000, 0, 0, 0});
  CHECK(arm.read({0, 0, -6000}).homed);
  CHECK(arm.read({400, 1000, -32768}).counts == Counts{400, -1000, -32768});  // wraps
  arm.driver.command(forcing({500, -500, 0}));
  CHECK(arm.arm().milliamps == Counts{500, 500, 0});
  static_cast<void>(arm.read({400, 1000, -5000}, true));  // in use counts are kept as they came
  CHECK(arm.encoders_set() == Encoders{400, 1000, -5000, 0, 0, 0});
}

TEST_CASE(
    "wooden: near home the button calibrates again, and other counts afterwards are no home") {
  Wooden arm;
  arm.home();
  CHECK_FALSE(arm.read({30, 200, 6100}, true).homed);  // slipped: home reads like this now
  CHECK(arm.encoders_set() == kHome);
  Wooden stubborn;
  static_cast<void>(stubborn.read({10, 20, 30}, true));
  stubborn.driver.command({});
  CHECK_FALSE(stubborn.read({10, 20, 30}).homed);  // the firmware set nothing
}

TEST_CASE("wooden: packets are as long as the device's own") {
  Wooden arm;
  arm.driver.command({});
  CHECK(arm.last().size() == wooden::kPacketBytes);
  CHECK(arm.read({0, 0, 0}, false, wooden::kLongPacketBytes).fresh);
  arm.driver.command({});
  CHECK(arm.last().size() == wooden::kLongPacketBytes);
  arm.port.incoming.emplace_back(13);
  arm.port.incoming.emplace_back(65);
  CHECK_FALSE(arm.driver.read().fresh);
  CHECK(arm.driver.refused() == 2);
  CHECK_FALSE(arm.read({0, 0, 1}).fresh);  // another firmware's
  CHECK(arm.driver.refused() == 3);
}

TEST_CASE("cartesian: positions come in steps to nearest, and none that would wrap is taken") {
  Bench<kerf::CartesianDriver> touch(10);
  const auto read = [&](std::int32_t um, std::uint32_t number) {
    kerf::CartesianReport report;
    report.number = number;
    report.position_um = {um, -um, 0};
    report.homed = report.powered = true;
    touch.port.push(kerf::encode(report));
    return touch.driver.read();
  };
  CHECK(read(1234, 1).counts == Counts{123, -123, 0});
  CHECK(read(1235, 2).counts == Counts{124, -124, 0});
  CHECK(read(327'674, 3).counts == Counts{32767, -32767, 0});
  CHECK(read(327'674, 4).homed);
  CHECK_FALSE(read(327'675, 5).fresh);
  CHECK_FALSE(read(1'000'000, 6).fresh);
  CHECK(touch.driver.refused() == 2);
  CHECK(read(0, 9).fresh);
  CHECK(touch.driver.lost() == 4);  // 5 to 8: what was refused has not arrived
  CHECK_FALSE(read(50, 9).fresh);   // repeated
  CHECK_FALSE(read(50, 8).fresh);   // old
}

TEST_CASE("cartesian: orientation, buttons and states arrive; without power it is not homed") {
  Bench<kerf::CartesianDriver> arm(4);
  kerf::CartesianReport report;
  report.number = 1;
  report.orientation = {1, -2, 3, 32767};
  report.button1 = report.parked = report.homed = true;
  arm.port.push(kerf::encode(report));
  const kerf::DeviceReport unpowered = arm.driver.read();
  CHECK(unpowered.kind == kerf::DeviceReport::Kind::pose);
  CHECK(unpowered.orientation == std::array<std::int16_t, 4>{1, -2, 3, 32767});
  CHECK((unpowered.button1 && !unpowered.button2 && unpowered.parked && !unpowered.homed));
  report.number = 2;
  report.powered = report.button2 = true;
  arm.port.push(kerf::encode(report));
  const kerf::DeviceReport powered = arm.driver.read();
  CHECK((powered.homed && powered.button2));
}

TEST_CASE("cartesian: the force goes out in mN with the light of the phase, and ends neutral") {
  Bench<kerf::CartesianDriver> arm(10);
  const auto sent = [&] { return kerf::decode_cartesian_command(arm.last()).value(); };
  arm.driver.start();
  CHECK(arm.port.sent.empty());  // the device speaks first
  CHECK(arm.driver.release());
  CHECK(sent() == kerf::CartesianCommand{});
  arm.driver.command(forcing({1500, -2, 0}));
  CHECK(sent().force_mn == Counts{1500, -2, 0});
  CHECK(sent().force_on);
  CHECK(sent().light == kerf::CartesianCommand::Light::ready);
  kerf::ServoOutput fault;
  fault.phase = kerf::Phase::fault;
  fault.dac_counts = {7, 7, 7};  // motors are off: no force, whatever stands here
  arm.driver.command(fault);
  CHECK(sent().force_mn == Counts{});
  CHECK(sent().light == kerf::CartesianCommand::Light::fault);
  CHECK(arm.driver.stay_released());
  arm.driver.command(forcing({1500, 0, 0}));
  CHECK(sent().force_mn == Counts{});
  CHECK_FALSE(sent().force_on);
}

TEST_CASE(
    "cartesian: readings that stand still under force are no reports, whatever their numbers") {
  Bench<kerf::CartesianDriver> arm(10);
  kerf::CartesianReport report;
  report.homed = report.powered = true;
  const auto next = [&] {
    ++report.number;
    arm.port.push(kerf::encode(report));
    return arm.driver.read().fresh;
  };
  constexpr int kTicks = 3000;  // kStillS at 1 kHz
  bool all_fresh = next();
  for (int tick = 0; tick < kTicks; ++tick) {
    arm.driver.command(forcing({100, 0, 0}));
    all_fresh = next() && all_fresh;
  }
  CHECK(all_fresh);
  CHECK_FALSE(next());
  report.position_um[1] = 10;
  CHECK(next());
}

TEST_CASE("cartesian: a gimbal that turns and buttons that are pressed are no life of a position") {
  for (const kerf::Personality kind :
       {kerf::Personality::inverse3, kerf::Personality::touch, kerf::Personality::omega}) {
    CAPTURE(static_cast<int>(kind));
    // Two arms: the second one moves, and is not taken for the first.
    const int step_um = kerf::cartesian::figures(kind)->step_um;
    Bench<kerf::CartesianDriver> still(step_um), moving(step_um);
    kerf::CartesianReport report;
    report.homed = report.powered = true;
    const auto next = [&](auto& arm, int tick, bool moves) {
      ++report.number;
      const double half_rad = 0.001 * (tick % 200);
      report.orientation =
          kerf::cartesian::packed_orientation({0, 0, std::sin(half_rad), std::cos(half_rad)})
              .value();
      report.button1 = tick % 3 == 0;
      report.position_um = {0, moves ? step_um * (tick % 2) : 0, 0};
      arm.port.push(kerf::encode(report));
      arm.driver.command(forcing({100, 0, 0}));
      return arm.driver.read().fresh;
    };
    constexpr int kTicks = 3000;  // kStillS at 1 kHz
    int fresh = 0, other = 0;
    for (int tick = 0; tick < kTicks + 20; ++tick) {
      fresh += next(still, tick, false) ? 1 : 0;
      other += next(moving, tick, true) ? 1 : 0;
    }
    CHECK(fresh == kTicks);
    CHECK(other == kTicks + 20);
    CHECK(still.driver.refused() == 20);
    CHECK(next(still, 1, true));
  }
}

TEST_CASE("falcon: buttons that are pressed are no life of a position") {
  Falcon falcon;
  int fresh = 0;
  for (int tick = 0; tick < 3020; ++tick) {
    falcon.driver.command(forcing({1, 0, 0}));
    const auto buttons = static_cast<std::uint8_t>(tick % 2 == 0 ? kerf::falcon::kButtonPlus : 0);
    fresh +=
        falcon.receive({.encoder = {5, 6, 7}, .buttons = buttons, .homed = kHomed}).fresh ? 1 : 0;
  }
  CHECK(fresh == 3001);  // the first one moves
}

}  // namespace kerf::drivers_test
