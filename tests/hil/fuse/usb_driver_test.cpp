// SPDX-License-Identifier: Apache-2.0
// The drivers of Falcon and WoodenHaptics with libusb and hidapi above the emulated nodes: start,
// force, faults, late reads; and one beside the other.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/device/port/hid_port.hpp"
#include "controller/device/port/usb_port.hpp"
#include "controller/loop/allocation_counter.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/woodenhaptics.hpp"
#include "tests/hil/fuse/bus_session.hpp"
#include "tests/support/errors.hpp"

namespace kerf::usb_driver_test {

using kerf::test::Course;
using kerf::test::error_of;
using kerf::test::has;
using kerf::test::kGoOn;
using kerf::test::MountedArm;
using kerf::test::MountedFalcon;
using kerf::test::ReadyServo;
using kerf::test::ServoSession;

namespace {

Personality personality_of(const MountedFalcon& /*device*/) {
  return Personality::falcon;
}
Personality personality_of(const MountedArm& /*device*/) {
  return Personality::woodenhaptics;
}
std::uint64_t lost(const MountedFalcon& device) {
  return device.node().chip().lost();
}
std::uint64_t lost(const MountedArm& device) {
  return device.node().lost();
}

std::unique_ptr<PacketPort> open(const std::string& text) {
  return kerf::open_port(text, {}, 0, kGoOn);
}

/// From start over calibration by hand and host to a force.
template <class Device>
void check_first_force(Device& device, const std::string& options = "") {
  {
    ReadyServo servo(personality_of(device));
    const auto port = open(device.port() + options);
    ServoSession session(std::move(servo), *port, &device.clock());
    const Course course = session.run(8000, [](const Course& c) { return c.contact > 300; });
    CHECK(course.contact > 300);
    CHECK(course.motors > 300);
    CHECK(course.fresh > course.ticks * 8 / 10);
    CHECK(session.driver().refused() == 0);
    CHECK(session.driver().release());
    for (const kerf::LinkCounter& counter : port->counters()) {
      if (counter.name == std::string_view("packets")) continue;
      if (counter.name == std::string_view("commands")) continue;
      if (counter.name == std::string_view("firmware_tries") && counter.value == 1) continue;
      CAPTURE(std::string(counter.name));
      CHECK(counter.value == 0);
    }
    CHECK_FALSE(port->closed());
  }
  device.stop();
  CHECK(device.emulator().model().calibration() == kerf::Calibration::done);
  CHECK(device.emulator().stats().refused == 0);
  CHECK(device.emulator().stats().peak_motor_force_n > 0.01);
  CHECK(lost(device) == 0);
}

/// A device that vanishes while the servo pushes: sets `pushes`.
template <class Device>
void check_unplugged(Device& device, std::atomic<bool>& pushes) {
  ReadyServo servo(personality_of(device));
  const auto port = open(device.port());
  ServoSession session(std::move(servo), *port, &device.clock());
  const Course course = session.run(8000, [&](const Course& c) {
    pushes = c.motors > 100;
    return port->closed();
  });
  CHECK(port->closed());
  CHECK(course.motors > 100);
  const Course after = session.run(100);
  CHECK(after.gap_at_end >= 99);  // packets from before the end may still be read
  CHECK(after.stale_with_motors == 0);
  CHECK_FALSE(session.driver().release());
  CHECK(has(error_of([&] { open(device.port()); }), "no such node"));
}

/// Sends `command` each millisecond, in which the device answers: no allocation.
template <class Packet>
void check_allocations(PacketPort& port, const Packet& command, std::size_t answer_bytes,
                       const std::function<void()>& unplug = {}) {
  std::array<std::uint8_t, 65> packet{};
  const std::uint64_t before = kerf::CountedAllocations::total();
  int received = 0, empty = 0;
  {
    const kerf::CountedAllocations counted;
    for (int i = 0; i < 200; ++i) {
      port.send(command);
      if (port.wait(100)) received += port.receive(packet) == answer_bytes ? 1 : 0;
      empty += port.receive(packet) == 0 ? 1 : 0;
    }
    if (unplug) unplug();
    for (int i = 0; unplug && i < 2000 && !port.closed(); ++i) {
      port.send(command);
      if (port.wait(1)) static_cast<void>(port.receive(packet));
    }
  }
  CHECK(port.closed() == static_cast<bool>(unplug));
  CHECK(kerf::CountedAllocations::total() == before);
  CHECK(received > 190);
  CHECK(empty > 100);
}

/// Notes how many ticks ago each command was made; `answers`: one in the next frame for each.
class AgingDevice final : public kerf::PacketDevice {
 public:
  explicit AgingDevice(bool answers) : answers_(answers) {}

  void receive(std::span<const std::uint8_t> packet) noexcept override {
    int tick = 0;
    if (const auto falcon = kerf::falcon::decode_command(packet)) {
      tick = falcon->motor[0];
      ++owed_;
    } else if (const auto arm = kerf::wooden::decode_command(packet)) {
      tick = arm->milliamps[0];
    }
    if (tick == 0) return;  // of the start
    ages.push_back(newest - tick);
    longest_gap = std::max(longest_gap, tick - last_);
    last_ = tick;
  }
  void advance(int cycles) noexcept override { cycle_ += cycles; }
  std::span<const std::uint8_t> next_packet() noexcept override {
    if (!answers_ || cycle_ % kerf::kCyclesPerUsbFrame != 0 || owed_ == 0) return {};
    --owed_;
    return answer_;
  }

  std::atomic<int> newest{0};  ///< tick of the host
  std::vector<int> ages;
  int longest_gap = 0;

 private:
  bool answers_;
  std::int64_t cycle_ = 0;
  int owed_ = 0, last_ = 0;
  kerf::falcon::PacketBytes answer_ = encode(kerf::FalconReport{});
};

/// 300 ticks of commands with their number; from 100 on the device takes nothing for a while.
template <class CommandOfTick>
void send_ticks(PacketPort& port, kerf::test::HeldClock& clock, AgingDevice& device,
                std::atomic<bool>& streams, CommandOfTick command_of) {
  clock.hold();
  for (std::int16_t tick = 1; tick <= 300; ++tick) {
    device.newest = tick;
    const std::uint64_t sent = kerf::test::commands_sent(port);
    CHECK(port.send(command_of(tick)));
    streams = tick >= 100;
    kerf::test::wait_for_command(port, sent, 10);
    clock.pass(1'000'000);
  }
}

/// A file in place of the firmware, which this project does not have.
std::string firmware_file(const kerf::test::TemporaryFolder& folder, std::size_t bytes) {
  std::string text;
  for (std::size_t i = 0; i < bytes; ++i) text += static_cast<char>(i * 7);
  return folder.write("firmware", text);
}

}  // namespace

TEST_CASE("usb, hid: from start over firmware, homing or calibration to a force") {
  const kerf::test::TemporaryFolder folder;
  MountedFalcon falcon({.firmware_runs = false});
  check_first_force(falcon, ",firmware=" + firmware_file(folder, 1000));
  CHECK(falcon.node().chip().firmware_bytes() == 1000);
  CHECK_FALSE(falcon.emulator().model().motors_on());  // the last command arrived
  for (const std::size_t bytes : {std::size_t{14}, std::size_t{64}}) {
    CAPTURE(bytes);
    MountedArm arm({.packet_bytes = bytes});
    arm.clock().hold();
    check_first_force(arm);
  }
}

TEST_CASE(
    "usb, hid: an unplugged device closes the port, and the motors are not commanded any more") {
  std::atomic<bool> falcon_pushes{false}, arm_pushes{false};
  MountedFalcon falcon({.firmware_runs = true}, {{0, UsbFault::vanish, &falcon_pushes}});
  check_unplugged(falcon, falcon_pushes);
  MountedArm arm({.script = {{0, UsbFault::vanish, &arm_pushes}}});
  check_unplugged(arm, arm_pushes);
}

TEST_CASE(
    "usb, hid: no read, no write, no empty read, no loss of the device allocates in the servo") {
  const MountedFalcon falcon;
  const auto usb = open(falcon.port());
  check_allocations(*usb, encode(kerf::FalconCommand{}), 16);
  std::atomic<bool> read_all{false};
  const MountedArm arm({.script = {{0, UsbFault::vanish, &read_all}}});
  const auto hid = open(arm.port());
  const auto command = encode(kerf::WoodenCommand{});
  check_allocations(*hid, std::span(command).first(14), 14, [&] { read_all = true; });
}

TEST_CASE("usb, hid: a device that took nothing for a while gets the newest command") {
  std::atomic<bool> usb_streams{false}, hid_streams{false};
  kerf::test::HeldClock clock;
  {
    AgingDevice device(true);
    kerf::test::ServedNode<kerf::UsbfsNode> served(
        "usb", kerf::test::become_device,
        kerf::FtdiFalcon::Settings{.firmware_runs = true, .clock = &clock},
        kerf::test::at_ms({{0, UsbFault::nak, &usb_streams}}), device);
    send_ticks(*open("usb:" + served.path()), clock, device, usb_streams, [](std::int16_t tick) {
      return encode(kerf::FalconCommand{.motor = {tick, 0, 0}});
    });
    served.stop();
    CHECK(device.longest_gap > 90);  // ticks in which it took nothing
    CHECK(std::ranges::max(device.ages) < device.longest_gap / 2);
  }
  clock.let_go();
  AgingDevice device(false);
  kerf::test::ServedNode<kerf::HidrawNode> served(
      "hidraw0", kerf::test::become_device,
      kerf::WoodenHid::Settings{.script = kerf::test::at_ms({{0, UsbFault::nak, &hid_streams}}),
                                .clock = &clock},
      device);
  send_ticks(*open("hid:" + served.path()), clock, device, hid_streams, [](std::int16_t tick) {
    const auto packet = encode(kerf::WoodenCommand{.milliamps = {tick, 0, 0}, .set_encoders = {}});
    return std::vector<std::uint8_t>(packet.begin(), packet.begin() + 14);
  });
  served.stop();
  std::ranges::sort(device.ages, std::greater<>{});
  REQUIRE(device.ages.size() > 2);
  CHECK(device.longest_gap > 90);
  CHECK(device.ages[0] >= device.longest_gap - 2);  // in the kernel's hands all the while
  CHECK(device.ages[1] < device.longest_gap / 2);   // then the newest
}

TEST_CASE(
    "hid: an arm that counts the other way is felt if the scene has its signs, else not at all") {
  // As in the makers' first branches. Down at the home pose is the forearm's joint alone: with a
  // wrong sign it goes up, and nothing is ever touched.
  for (const bool signs : {true, false}) {
    CAPTURE(signs);
    MountedArm arm({}, kerf::test::touching_hand(), {-1, 1, -1});
    {
      kerf::LoadedScene scene = kerf::test::half_space_scene();
      if (signs) scene.device.encoder_sign = std::array{-1.0, 1.0, -1.0};
      ReadyServo servo(Personality::woodenhaptics, std::move(scene));
      const auto port = open(arm.port());
      ServoSession session(std::move(servo), *port, &arm.clock());
      const Course course =
          session.run(signs ? 8000 : 2500, [](const Course& c) { return c.contact > 300; });
      CHECK((course.contact > 300) == signs);
      CHECK(course.faults == 0);
    }
    arm.stop();
    CHECK(arm.emulator().model().calibration() == kerf::Calibration::done);
    CHECK((arm.emulator().stats().peak_motor_force_n > 0.01) == signs);
  }
}

TEST_CASE("hid: a servo that stops reading for a while finds the newest state again") {
  MountedArm arm;
  ReadyServo servo(Personality::woodenhaptics);
  const auto port = open(arm.port());
  ServoSession session(std::move(servo), *port, &arm.clock());
  static_cast<void>(session.run(50));
  arm.clock().pass(100'000'000);  // more than the mailbox holds
  kerf::sleep_until_ns(kerf::monotonic_ns() + 100'000'000);
  CHECK(session.run(100).fresh > 90);
  CHECK(session.driver().refused() == 0);
}

TEST_CASE("usb, hid: a Falcon that cannot start and a node of another device are refused") {
  const kerf::test::TemporaryFolder folder;
  const std::string firmware = ",firmware=" + firmware_file(folder, 200);
  const auto error = [](const std::string& port) { return error_of([&] { open(port); }); };
  const MountedFalcon empty({.firmware_runs = false});
  CHECK(has(error(empty.port()), "the Falcon has no firmware since it was powered up"));
  const MountedFalcon wrong({.firmware_runs = false, .wrong_echo_at = 100});
  CHECK(has(error(wrong.port() + firmware),
            ": firmware: byte 100 was 188 and came back as 189, in the last of 5 tries; "));
  const MountedFalcon falcon;
  const MountedArm arm;
  CHECK(has(error("usb:" + arm.path()), "is no USB device"));
  CHECK(has(error("hid:" + falcon.path()), "is another device than the arm"));
  const auto first = open(falcon.port());
  CHECK(has(error(falcon.port()), "cannot be claimed (Resource busy)"));
}

TEST_CASE("usb: the last packet of a process has left when the call returns") {
  const MountedFalcon falcon;
  UsbPort port({falcon.path(), ""}, 0, kGoOn);
  const std::uint64_t before = port.stats().commands;
  CHECK(port.send_last(encode(kerf::FalconCommand{})));
  CHECK(port.stats().commands == before + 1);
}

TEST_CASE("usb: packets in pieces are put together, none is bad, none is lost") {
  std::atomic<bool> streams{false};
  MountedFalcon falcon({.firmware_runs = true},
                       {{0, UsbFault::split, &streams}, {600, UsbFault::split}});
  std::uint64_t packets = 0;
  {
    ReadyServo servo(Personality::falcon);
    UsbPort port({falcon.path(), ""}, 0, kGoOn);
    {
      ServoSession session(std::move(servo), port, &falcon.clock());
      const Course course = session.run(1000, [&](const Course& c) {
        streams = c.fresh > 50;
        return false;
      });
      CHECK(course.fresh > 600);
      CHECK(course.longest_gap < 200);
      CHECK(session.driver().refused() == 0);
      CHECK(port.stats().strays == 0);
    }
    // Bytes in the line still come: 256 at most, 9 in a frame.
    for (int tries = 0; tries < 1000 && port.stats().packets < port.stats().commands; ++tries) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    packets = port.stats().packets;
  }
  falcon.stop();
  // The first ones, one as a rule, answered the question whether the firmware runs.
  CHECK(falcon.node().chip().reports() - packets <= 2);
}

TEST_CASE("usb: the device answers in each of its frames, wherever the servo ticks in them") {
  MountedFalcon falcon({.firmware_runs = true}, {}, std::nullopt);
  ReadyServo servo(Personality::falcon);
  const auto port = open(falcon.port());
  ServoSession session(std::move(servo), *port, &falcon.clock());
  static_cast<void>(session.run(10));
  for (int phase = 0; phase < 10; ++phase) {
    CAPTURE(phase);
    constexpr int kTicks = 100;
    falcon.clock().pass(100'000);
    CHECK(session.run(kTicks).fresh > kTicks * 8 / 10);
  }
}

TEST_CASE("usb: a stalled endpoint is freed when no read waits there, and the stream goes on") {
  std::atomic<bool> once{false}, twice{false};
  MountedFalcon falcon({.firmware_runs = true},
                       {{0, UsbFault::stall, &once}, {0, UsbFault::stall, &twice}});
  {
    ReadyServo servo(Personality::falcon);
    UsbPort port({falcon.path(), ""}, 0, kGoOn);
    ServoSession session(std::move(servo), port, &falcon.clock());
    const Course course = session.run(1000, [&](const Course& c) {
      once = c.fresh > 100;
      twice = c.fresh > 300;
      return false;
    });
    CHECK(port.stats().failures >= 2);
    CHECK(course.longest_gap < 200);
    CHECK(course.gap_at_end < 100);
    CHECK(session.driver().refused() == 0);
    CHECK_FALSE(port.closed());
  }
  falcon.stop();
  CHECK(falcon.node().rash_clears() == 0);
}

TEST_CASE("usb, hid: one of two devices dies, the other's force and timing stay as they were") {
  MountedArm arm({}, kerf::test::pressing_hand());
  std::atomic<bool> both_push{false};
  MountedFalcon falcon({.firmware_runs = true}, {{0, UsbFault::vanish, &both_push}});
  ReadyServo arm_servo(Personality::woodenhaptics, kerf::test::firm_half_space());
  ReadyServo falcon_servo(Personality::falcon);
  const auto arm_port = open(arm.port());
  const auto falcon_port = open(falcon.port());
  ServoSession arm_session(std::move(arm_servo), *arm_port, &arm.clock());
  ServoSession falcon_session(std::move(falcon_servo), *falcon_port, &falcon.clock());

  constexpr int kSettle = 300;  // ticks of contact before the force has come to rest
  constexpr std::size_t kCompared = 500;
  std::vector<double> before_n, after_n;  // of the arm, while both run and afterwards
  int contact = 0;
  arm_session.watch([&](const kerf::ServoOutput& output) {
    if (!output.contact || ++contact <= kSettle) return;
    const double n = std::hypot(output.commanded_force_n[0], output.commanded_force_n[1],
                                output.commanded_force_n[2]);
    (falcon_port->closed() ? after_n : before_n).push_back(n);
  });
  std::atomic<bool> arm_done{false}, falcon_pushes{false};
  Course of_falcon;
  std::thread beside([&] {
    of_falcon = falcon_session.run(8000, [&](const Course& c) {
      falcon_pushes = c.motors > 0;
      return arm_done.load();
    });
  });
  const Course of_arm = arm_session.run(8000, [&](const Course&) {
    both_push = before_n.size() >= kCompared && falcon_pushes;
    return after_n.size() >= kCompared;
  });
  arm_done = true;
  beside.join();

  CHECK(of_falcon.motors > 0);  // it died in action
  CHECK(of_falcon.faults > 0);
  CHECK(of_falcon.stale_with_motors == 0);
  CHECK(of_arm.faults == 0);
  CHECK(of_arm.fresh > of_arm.ticks * 8 / 10);
  REQUIRE(before_n.size() >= kCompared);
  REQUIRE(after_n.size() == kCompared);
  CHECK(std::ranges::min(after_n) > std::ranges::min(before_n) * 0.9);
  CHECK(std::ranges::max(after_n) < std::ranges::max(before_n) * 1.1);
}

}  // namespace kerf::usb_driver_test
