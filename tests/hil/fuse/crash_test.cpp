// SPDX-License-Identifier: Apache-2.0
// A controller that dies with torque on the motors: on FireWire its last packet must leave before
// the kernel takes the stream down with the process.
#include <atomic>
#include <chrono>
#include <csignal>
#include <thread>

#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "controller/device/device_driver.hpp"
#include "controller/device/firewire/firewire_port.hpp"
#include "controller/loop/motor_guard.hpp"
#include "tests/hil/fuse/mounted_node.hpp"

namespace {

/// The child commands torque for 100 ms and then goes the way `way_out`.
template <class WayOut>
int status_of(const std::string& node, WayOut way_out) {
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    const std::atomic<bool> go_on{false};
    kerf::FirewireOptions options;
    options.where = node;
    {
      kerf::FirewirePort port(options, 1000, go_on);
      kerf::OmniDriver driver(port);
      kerf::MotorGuard guard(driver);
      const kerf::HandlerStack handlers = guard.guard_stack();
      kerf::ServoOutput output;
      output.motor_counts = {100, 100, 100};
      output.motors_on = true;
      for (int tick = 0; tick < 100; ++tick) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        static_cast<void>(driver.read());
        driver.command(output);
      }
      way_out();
    }
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return status;
}

template <class WayOut>
void check_motors_off_after(WayOut way_out, int deadly_signal) {
  kerf::FirewireSettings settings;
  settings.clock = kerf::BusClock::real_time();
  kerf::test::MountedNode mounted(settings);
  const int status = status_of(mounted.path(), way_out);
  CHECK((WIFSIGNALED(status) ? WTERMSIG(status) : 0) == deadly_signal);
  mounted.stop();
  CHECK(mounted.emulator().stats().peak_motor_force_n > 0);
  CHECK_FALSE(mounted.emulator().model().motors_on());
}

}  // namespace

TEST_CASE(
    "the motors of an arm on FireWire are off after the end of its controller, however it ends") {
  check_motors_off_after([] {}, 0);
  check_motors_off_after([] { std::raise(SIGABRT); }, SIGABRT);
#ifndef KERF_SANITIZED  // they take this one for themselves
  check_motors_off_after([] { std::raise(SIGSEGV); }, SIGSEGV);
#endif
}
