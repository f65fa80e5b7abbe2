// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <thread>

#include <doctest/doctest.h>
#include <pthread.h>
#include <sched.h>

#include "controller/device/device_driver.hpp"
#include "controller/loop/servo_loop.hpp"
#include "shared/posix/threads.hpp"
#include "shared/wire/omni.hpp"

namespace {

class CountingPort final : public kerf::PacketPort {
 public:
  std::size_t receive(std::span<std::uint8_t>) noexcept override { return 0; }
  bool send(std::span<const std::uint8_t> packet) noexcept override {
    const auto command = kerf::decode_command(packet);
    neutral += command && *command == kerf::OmniCommand{} ? 1 : 0;
    return true;
  }
  bool closed() const noexcept override { return false; }
  bool wait(int) noexcept override { return false; }
  int neutral = 0;
};

constexpr std::int64_t kMs = 1'000'000;

}  // namespace

TEST_CASE("a servo that stands still for 20 ms loses its motors, once per stall") {
  CountingPort port;
  kerf::OmniDriver driver(port);
  std::atomic<bool> stop{false};
  kerf::LoopSignals signals{stop};
  kerf::Watchdog watchdog(driver, signals);
  std::int64_t now = 0;
  watchdog.look(now += 1000 * kMs);  // not started yet: nothing to watch
  CHECK(port.neutral == 0);

  signals.heartbeat = 1;
  watchdog.look(now += 5 * kMs);
  for (int ms = 5; ms < 20; ms += 5) {
    watchdog.look(now += 5 * kMs);
    CHECK(port.neutral == 0);
  }
  watchdog.look(now += 5 * kMs);
  watchdog.look(now += 5 * kMs);
  CHECK(port.neutral == 1);
  CHECK(signals.stalled);
  CHECK(watchdog.trips() == 1);

  signals.heartbeat = 2;
  watchdog.look(now += 5 * kMs);
  watchdog.look(now += 25 * kMs);
  CHECK(watchdog.trips() == 2);
}

TEST_CASE("of a tick that stood still itself nothing is sent, and of the next one all") {
  CountingPort port;
  kerf::OmniDriver driver(port);
  std::atomic<bool> stop{false};
  kerf::LoopSignals signals{stop};
  kerf::ServoOutput push;
  push.motors_on = true;
  push.motor_counts = {100, -200, 300};
  signals.stalled = true;  // the watchdog looked while the tick lasted
  kerf::send_tick(push, signals, driver);
  CHECK(port.neutral == 1);
  signals.stalled = false;
  kerf::send_tick(push, signals, driver);
  CHECK(port.neutral == 1);
}

TEST_CASE("the watchdog's thread may run on every core but the servo's") {
  const auto cores = kerf::allowed_cores();
  if (cores.size() < 2) return;  // nowhere to go
  CountingPort port;
  kerf::OmniDriver driver(port);
  std::atomic<bool> stop{false};
  kerf::LoopSignals signals{stop};
  kerf::Watchdog watchdog(driver, signals);
  for (const int servo : {cores.front(), cores.back()}) {
    std::jthread watching = kerf::start_watchdog(watchdog, {.cpu = servo});
    const auto may_run_on = [&](int core) {
      cpu_set_t set;
      REQUIRE(pthread_getaffinity_np(watching.native_handle(), sizeof set, &set) == 0);
      return CPU_ISSET(static_cast<std::size_t>(core), &set) != 0;
    };
    // It leaves by itself, some time after it was started.
    for (int tries = 0; tries < 5000 && may_run_on(servo); ++tries) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    for (const int core : cores) CHECK(may_run_on(core) == (core != servo));
  }
}
