// SPDX-License-Identifier: Apache-2.0
// A Falcon and a WoodenHaptics arm on one machine, each with its own servo; the Falcon dies.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>
#include <utility>

#include <doctest/doctest.h>

#include "controller/device/port/hid_port.hpp"
#include "controller/device/port/usb_port.hpp"
#include "tests/hil/fuse/usb_session.hpp"

using kerf::Personality;
using kerf::UsbFault;
using kerf::test::kGoOn;
using kerf::test::MountedArm;
using kerf::test::MountedFalcon;
using kerf::test::ReadyServo;
using kerf::test::ServoSession;

namespace {

/// An arm that presses on, over a part of a run.
struct Part {
  int ticks = 0;
  double least_n = 1000, most_n = 0;

  void add(const kerf::ServoOutput& output) {
    const double n = std::hypot(output.force_n[0], output.force_n[1], output.force_n[2]);
    ++ticks;
    least_n = std::min(least_n, n);
    most_n = std::max(most_n, n);
  }
};

}  // namespace

TEST_CASE("usb: one of two devices dies, the other's force and timing stay as they were") {
  MountedArm arm({}, kerf::test::pressing_hand());
  std::atomic<bool> both_push{false};
  MountedFalcon falcon({.firmware_runs = true}, {{0, UsbFault::vanish, &both_push}});
  ReadyServo arm_servo(Personality::woodenhaptics, kerf::test::firm_half_space());
  ReadyServo falcon_servo(Personality::falcon);
  kerf::HidPort arm_port(arm.path(), 0, kGoOn);
  kerf::UsbPort falcon_port({falcon.path(), ""}, 0, kGoOn);
  ServoSession arm_session(std::move(arm_servo), arm_port, arm.clock());
  ServoSession falcon_session(std::move(falcon_servo), falcon_port, falcon.clock());

  constexpr int kSettle = 300;  // ticks of contact before the force has come to rest
  constexpr int kCompared = 500;
  Part before, after;
  int contact = 0;
  arm_session.watch([&](const kerf::ServoOutput& output) {
    if (output.contact && ++contact > kSettle) (falcon_port.closed() ? after : before).add(output);
  });
  std::atomic<bool> arm_done{false}, falcon_pushes{false};
  ServoSession::Course of_falcon;
  std::thread beside([&] {
    of_falcon = falcon_session.run(8000, [&](const auto& c) {
      falcon_pushes = c.motors > 0;
      return arm_done.load();
    });
  });
  const auto of_arm = arm_session.run(8000, [&](const auto&) {
    both_push = before.ticks >= kCompared && falcon_pushes;
    return after.ticks >= kCompared;
  });
  arm_done = true;
  beside.join();

  CHECK(of_falcon.motors > 0);  // it died in action
  CHECK(of_falcon.faults > 0);
  CHECK(of_falcon.stale_with_motors == 0);
  CHECK(of_arm.faults == 0);
  CHECK(of_arm.fresh > of_arm.ticks * 8 / 10);
  REQUIRE(before.ticks >= kCompared);
  REQUIRE(after.ticks == kCompared);
  CHECK(after.least_n > before.least_n * 0.9);
  CHECK(after.most_n < before.most_n * 1.1);
}
