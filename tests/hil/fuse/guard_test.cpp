// SPDX-License-Identifier: Apache-2.0
// --guard above real buses: the calls of the servo thread there are allowed, and no other.
#include <atomic>
#include <memory>
#include <span>
#include <string>
#include <thread>

#include <doctest/doctest.h>
#include <unistd.h>

#include "controller/loop/motor_guard.hpp"
#include "tests/hil/fuse/bus_session.hpp"

namespace kerf::guard_test {
namespace {

using kerf::test::kGoOn;

/// Guarded ticks of a driver on the bus at `text`, until it is gone, at most 2000. Returns the name
/// of the call that was trapped, empty if none. `seeded`: the loop makes a call that no bus needs.
/// FireWire is in lock-step here, and needs no clock.
std::string unexpected_call(Personality personality, const std::string& text, bool seeded = false) {
  const bool lockstep = personality == Personality::omni;
  const auto port = kerf::open_port(text, {}, 1000, kGoOn);
  const auto driver = kerf::make_driver(personality, *port);
  driver->start();
  std::atomic<bool> stop{false};
  kerf::MotorGuard motors(*driver);
  kerf::CallGuard calls(*driver, stop);
  std::thread([&] {
    const kerf::HandlerStack handlers = motors.guard_stack();
    calls.enter(std::span(&text, 1));
    std::int64_t deadline_ns = kerf::monotonic_ns();
    for (int tick = 0; tick < 2000 && !stop && !port->closed(); ++tick) {
      if (!lockstep) deadline_ns += 1'000'000;
      kerf::sleep_until_ns(deadline_ns);
      static_cast<void>(driver->read());
      driver->command({});
      if (seeded && tick == 20) getppid();
    }
    calls.leave();
  }).join();
  CHECK(stop == seeded);
  return calls.unexpected();
}

}  // namespace

TEST_CASE("the guard lets each bus make its calls, also when channels are lost or it vanishes") {
  {
    kerf::FirewireSettings settings;
    settings.script = {{8 * 100, BusFault::steal}};
    const kerf::test::MountedNode omni(settings);
    CHECK(unexpected_call(Personality::omni, omni.port()) == "");
  }
  {
    const kerf::test::MountedFalcon falcon({.firmware_runs = true}, {{1000, UsbFault::vanish}});
    CHECK(unexpected_call(Personality::falcon, falcon.port()) == "");
  }
  {
    const kerf::test::MountedArm arm({.script = {{1000, UsbFault::vanish}}});
    CHECK(unexpected_call(Personality::woodenhaptics, arm.port()) == "");
  }
}

TEST_CASE("the guard ends a loop that makes another call, on each bus") {
  const kerf::test::MountedNode omni;
  CHECK(unexpected_call(Personality::omni, omni.port(), true) == "getppid");
  const kerf::test::MountedFalcon falcon;
  CHECK(unexpected_call(Personality::falcon, falcon.port(), true) == "getppid");
  const kerf::test::MountedArm arm;
  CHECK(unexpected_call(Personality::woodenhaptics, arm.port(), true) == "getppid");
}

}  // namespace kerf::guard_test
