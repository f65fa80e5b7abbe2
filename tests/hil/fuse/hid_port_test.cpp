// SPDX-License-Identifier: Apache-2.0
// The WoodenHaptics driver with hidapi itself above the emulated node: calibration, force, faults.
#include "controller/device/hid_port.hpp"

#include <array>
#include <span>
#include <string>

#include <doctest/doctest.h>

#include "controller/shell/allocation_counter.hpp"
#include "shared/wire/wooden_packet.hpp"
#include "tests/hil/fuse/usb_session.hpp"

using kerf::HidPort;
using kerf::Personality;
using kerf::UsbFault;
using kerf::test::kGoOn;
using kerf::test::MountedArm;
using kerf::test::ServoSession;

TEST_CASE("hid: from the calibration button to a force, with short and with long reports") {
  for (const std::size_t bytes : {std::size_t{14}, std::size_t{64}}) {
    CAPTURE(bytes);
    MountedArm arm({.packet_bytes = bytes});
    {
      HidPort port(arm.path(), 0, kGoOn);
      ServoSession session(Personality::woodenhaptics, port);
      const auto course = session.run(8000, [](const auto& c) { return c.contact > 300; });
      CHECK(course.contact > 300);
      CHECK(course.motors > 300);
      if (kerf::test::kKeepsTime) CHECK(course.fresh > course.ticks * 8 / 10);
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

TEST_CASE("hid: neither a read, nor a write, nor a read of nothing allocates") {
  const MountedArm arm;
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
  }
  CHECK(kerf::CountedAllocations::total() == before);
  CHECK(received > 190);
  CHECK(empty > 100);
}

TEST_CASE("hid: an unplugged arm closes the port, and the motors are not asked for any more") {
  MountedArm arm({.script = {{4500, UsbFault::vanish}}});
  HidPort port(arm.path(), 0, kGoOn);
  ServoSession session(Personality::woodenhaptics, port);
  const auto course = session.run(8000, [&](const auto&) { return port.closed(); });
  CHECK(port.closed());
  CHECK(course.motors > 100);
  CHECK(course.ticks < 6000);
  const auto after = session.run(100);
  CHECK(after.fresh == 0);
  CHECK(after.stale_with_motors == 0);
  CHECK_FALSE(session.driver().release());
  CHECK_THROWS_WITH_AS(HidPort(arm.path(), 0, kGoOn), doctest::Contains("no WoodenHaptics arm"),
                       std::runtime_error);
}

TEST_CASE("hid: a servo that stops reading for a while finds the newest state again") {
  const MountedArm arm;
  HidPort port(arm.path(), 0, kGoOn);
  ServoSession session(Personality::woodenhaptics, port);
  static_cast<void>(session.run(50));
  kerf::sleep_until_ns(kerf::monotonic_ns() + 100'000'000);  // more than the kernel's queue holds
  const auto course = session.run(100);
  if (kerf::test::kKeepsTime) CHECK(course.fresh > 90);
  CHECK(session.driver().refused() == 0);
}

TEST_CASE("hid: a node of another kind is refused") {
  const kerf::test::MountedFalcon falcon;
  CHECK_THROWS_WITH_AS(HidPort(falcon.path(), 0, kGoOn),
                       doctest::Contains("is another device than the arm"), std::runtime_error);
}
