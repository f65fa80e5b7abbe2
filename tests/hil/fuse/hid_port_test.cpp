// SPDX-License-Identifier: Apache-2.0
// The WoodenHaptics driver with hidapi itself above the emulated node: calibration, force, faults.
#include "controller/device/port/hid_port.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/loop/allocation_counter.hpp"
#include "shared/wire/woodenhaptics.hpp"
#include "tests/hil/fuse/usb_session.hpp"

using kerf::HidPort;
using kerf::Personality;
using kerf::UsbFault;
using kerf::test::kGoOn;
using kerf::test::MountedArm;
using kerf::test::ReadyServo;
using kerf::test::ServoSession;

namespace {

/// Never answers; notes how many ticks ago each command was made.
class ListeningDevice final : public kerf::PacketDevice {
 public:
  void receive(std::span<const std::uint8_t> packet) noexcept override {
    const auto command = kerf::wooden::decode_command(packet);
    if (!command) return;
    const int tick = command->milliamps[0];
    ages.push_back(newest - tick);
    longest_gap = std::max(longest_gap, tick - last_);
    last_ = tick;
  }
  void advance(int /*cycles*/) noexcept override {}
  std::span<const std::uint8_t> next_packet() noexcept override { return {}; }

  std::atomic<int> newest{0};  ///< tick of the host
  std::vector<int> ages;
  int longest_gap = 0;

 private:
  int last_ = 0;
};

}  // namespace

TEST_CASE("hid: from the calibration button to a force, with short and with long reports") {
  for (const std::size_t bytes : {std::size_t{14}, std::size_t{64}}) {
    CAPTURE(bytes);
    MountedArm arm({.packet_bytes = bytes});
    arm.clock().hold();
    {
      ReadyServo servo(Personality::woodenhaptics);
      HidPort port(arm.path(), 0, kGoOn);
      ServoSession session(std::move(servo), port, arm.clock());
      const auto course = session.run(8000, [](const auto& c) { return c.contact > 300; });
      CHECK(course.contact > 300);
      CHECK(course.motors > 300);
      CHECK(course.fresh > course.ticks * 8 / 10);
      CHECK(session.driver().refused() == 0);
      CHECK(session.driver().release());
    }
    arm.stop();
    CHECK(arm.emulator().model().calibration() == kerf::Calibration::done);
    CHECK(arm.emulator().stats().refused == 0);
    CHECK(arm.emulator().stats().peak_motor_force_n > 0.01);
    CHECK(arm.node().lost() == 0);
  }
}

TEST_CASE("hid: an arm that counts the other way is felt where it is told, and else not at all") {
  // As in the makers' first branches. Down at the home pose is the forearm's joint alone: told
  // wrongly it goes up, and nothing is ever touched.
  for (const bool told : {true, false}) {
    CAPTURE(told);
    MountedArm arm({}, kerf::test::touching_hand(), {-1, 1, -1});
    {
      kerf::LoadedScene scene = kerf::test::half_space_scene();
      if (told) scene.device.encoder_sign = std::array{-1.0, 1.0, -1.0};
      ReadyServo servo(Personality::woodenhaptics, std::move(scene));
      HidPort port(arm.path(), 0, kGoOn);
      ServoSession session(std::move(servo), port, arm.clock());
      const auto course =
          session.run(told ? 8000 : 2500, [](const auto& c) { return c.contact > 300; });
      CHECK((course.contact > 300) == told);
      CHECK(course.faults == 0);
    }
    arm.stop();
    CHECK(arm.emulator().model().calibration() == kerf::Calibration::done);
    CHECK((arm.emulator().stats().peak_motor_force_n > 0.01) == told);
  }
}

TEST_CASE("hid: no read, no write, no read of nothing, no loss of the arm allocates in the servo") {
  std::atomic<bool> read_all{false};
  const MountedArm arm({.script = {{0, UsbFault::vanish, &read_all}}});
  HidPort port(arm.path(), 0, kGoOn);
  const auto command = encode(kerf::WoodenCommand{});
  std::array<std::uint8_t, 65> packet{};
  const std::uint64_t before = kerf::CountedAllocations::total();
  int received = 0, empty = 0;
  {
    const kerf::CountedAllocations counted;
    for (int i = 0; i < 200; ++i) {
      port.send(std::span(command).first(14));
      if (port.wait(100)) received += port.receive(packet) == 14 ? 1 : 0;
      empty += port.receive(packet) == 0 ? 1 : 0;
    }
    read_all = true;
    for (int i = 0; i < 2000 && !port.closed(); ++i) {
      port.send(std::span(command).first(14));
      if (port.wait(1)) static_cast<void>(port.receive(packet));
    }
  }
  CHECK(port.closed());
  CHECK(kerf::CountedAllocations::total() == before);
  CHECK(received > 190);
  CHECK(empty > 100);
}

TEST_CASE("hid: a device that took nothing for a while gets what was on its way, then the newest") {
  ListeningDevice device;
  std::atomic<bool> streams{false};
  kerf::test::HeldClock clock;
  kerf::test::ServedNode<kerf::HidrawNode> served(
      "hidraw0", kerf::test::become_device,
      kerf::WoodenHid::Settings{.script = kerf::test::at_ms({{0, UsbFault::deaf, &streams}}),
                                .clock = &clock},
      device);
  {
    HidPort port(served.path(), 0, kGoOn);
    clock.hold();
    for (std::int16_t tick = 1; tick <= 300; ++tick) {
      device.newest = tick;
      const std::uint64_t sent = kerf::test::commands_sent(port);
      const kerf::WoodenCommand command{.milliamps = {tick, 0, 0}, .set_encoders = {}};
      CHECK(port.send(std::span<const std::uint8_t>(encode(command)).first(14)));
      streams = tick >= 100;
      kerf::test::wait_for_command(port, sent, 10);
      clock.pass(1'000'000);
    }
  }
  served.stop();
  std::ranges::sort(device.ages, std::greater<>{});
  REQUIRE(device.ages.size() > 2);
  CHECK(device.longest_gap > 90);                   // ticks that went on while it heard nothing
  CHECK(device.ages[0] >= device.longest_gap - 2);  // in the kernel's hands all the while
  CHECK(device.ages[1] < device.longest_gap / 2);
}

TEST_CASE("hid: an unplugged arm closes the port, and the motors are not asked for any more") {
  std::atomic<bool> pushes{false};
  MountedArm arm({.script = {{0, UsbFault::vanish, &pushes}}});
  ReadyServo servo(Personality::woodenhaptics);
  HidPort port(arm.path(), 0, kGoOn);
  ServoSession session(std::move(servo), port, arm.clock());
  const auto course = session.run(8000, [&](const auto& c) {
    pushes = c.motors > 100;
    return port.closed();
  });
  CHECK(port.closed());
  CHECK(course.motors > 100);
  const auto after = session.run(100);
  CHECK(after.gap_at_end >= 99);  // what came before the end may still be read
  CHECK(after.stale_with_motors == 0);
  CHECK_FALSE(session.driver().release());
  CHECK_THROWS_WITH_AS(HidPort(arm.path(), 0, kGoOn), doctest::Contains("no such node"),
                       std::runtime_error);
}

TEST_CASE("hid: a servo that stops reading for a while finds the newest state again") {
  MountedArm arm;
  ReadyServo servo(Personality::woodenhaptics);
  HidPort port(arm.path(), 0, kGoOn);
  ServoSession session(std::move(servo), port, arm.clock());
  static_cast<void>(session.run(50));
  arm.clock().pass(100'000'000);  // more than the mailbox holds
  kerf::sleep_until_ns(kerf::monotonic_ns() + 100'000'000);
  const auto course = session.run(100);
  CHECK(course.fresh > 90);
  CHECK(session.driver().refused() == 0);
}

TEST_CASE("hid: a node of another kind is refused") {
  const kerf::test::MountedFalcon falcon;
  CHECK_THROWS_WITH_AS(HidPort(falcon.path(), 0, kGoOn),
                       doctest::Contains("is another device than the arm"), std::runtime_error);
}
