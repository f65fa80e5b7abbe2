// SPDX-License-Identifier: Apache-2.0
// The controller's port on the page, in one process with the adapter's end.
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include <doctest/doctest.h>

#include "controller/device/device_driver.hpp"
#include "controller/device/open_port.hpp"
#include "shared/arm/arm_page.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::arm_port_test {

using kerf::test::error_of;
using kerf::test::RuntimeFolder;

namespace {

std::unique_ptr<kerf::PacketPort> open_arm(const std::string& text,
                                           Personality device = Personality::touch,
                                           int patience_ms = 0) {
  const std::atomic<bool> stop{false};
  return kerf::open_port(text, {device, false, 1000}, patience_ms, stop);
}

}  // namespace

TEST_CASE("arm port: auto finds it for a touch and an omega, and no other device") {
  CHECK(kerf::resolve_port("auto", Personality::touch) == "arm");
  CHECK(kerf::resolve_port("auto", Personality::omega) == "arm");
  CHECK(kerf::resolve_port("arm:left", Personality::touch) == "arm:left");
  CHECK_THROWS(static_cast<void>(kerf::resolve_port("arm", Personality::omni)));
  CHECK_NOTHROW(kerf::check_port("arm"));
  CHECK_NOTHROW(kerf::check_port("arm:left"));
  CHECK(error_of([] { kerf::check_port("arm,x"); }).starts_with("--port arm,x: not the name of "));
  CHECK_THROWS(kerf::check_port("arm:"));
  CHECK_THROWS(kerf::check_port("arm:../x"));
}

TEST_CASE("arm port: without an adapter, with one that is not ready or has ended: one line each") {
  const RuntimeFolder folder;
  CHECK(error_of([] { open_arm("arm"); }) ==
        "--port arm:touch: no kerf-arm for touch; start ./kerf arm --device touch");
  CHECK(error_of([] {
          open_arm("arm:left");
        }).starts_with("--port arm:left: no kerf-arm named left; "));
  ArmPageAdapter arm("touch", Personality::touch, 1000);
  arm.set_state(ArmState::starting, "the vendor's library opens the device");
  CHECK(error_of([] { open_arm("arm"); }) ==
        "--port arm:touch: the kerf-arm for touch is not ready (the vendor's library opens the "
        "device); see what it waits for");
  arm.set_state(ArmState::failed, "no\ncable");
  const std::string ended = error_of([] { open_arm("arm"); });
  CHECK(ended.find("has ended") != std::string::npos);
  CHECK(ended.find('\n') == std::string::npos);
}

TEST_CASE("arm port: a driver above it reads poses and gives forces; the end of the arm releases") {
  const RuntimeFolder folder;
  ArmPageAdapter arm("touch", Personality::touch, 1000);
  arm.set_state(ArmState::running, "");
  const auto port = open_arm("arm");
  const auto driver = kerf::make_driver(Personality::touch, *port);
  driver->start();
  CHECK_FALSE(arm.newest());  // nothing is sent before the first command
  CHECK_FALSE(driver->read().fresh);
  CHECK_FALSE(port->wait(0));
  kerf::CartesianReport report;
  report.homed = report.powered = report.parked = true;
  for (int i = 1; i <= 4; ++i) {
    report.position_um = {1000 * i, 0, 0};
    arm.publish(report, i);
  }
  CHECK(port->wait(0));
  const kerf::DeviceReport read = driver->read();
  CHECK((read.fresh && read.homed && read.parked));
  CHECK(read.counts[0] == 400);
  CHECK(driver->lost() == 0);  // four reports in one tick are none lost
  kerf::ServoOutput output;
  output.phase = kerf::Phase::active;
  output.motors_on = true;
  output.dac_counts = {1500, 0, 0};
  driver->command(output);
  CHECK(arm.newest()->command.force_mn[0] == 1500);
  CHECK(arm.newest()->command.answers == 4);
  arm.set_state(ArmState::failed, "cable");
  CHECK(port->closed());
  static_cast<void>(driver->read());
  driver->command(output);
  CHECK_FALSE(arm.newest()->command.force_on);
  CHECK_FALSE(port->wait(1000));  // at once
}

}  // namespace kerf::arm_port_test
