// SPDX-License-Identifier: Apache-2.0
// The loop around the servo: its clock, its gate, its watchdog, its end.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <future>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>

#include <doctest/doctest.h>
#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <sys/stat.h>
#include <unistd.h>

#include "controller/device/device_driver.hpp"
#include "controller/device/devices.hpp"
#include "controller/load/scene_json.hpp"
#include "controller/loop/publisher.hpp"
#include "controller/loop/servo_loop.hpp"
#include "controller/loop/tick_source.hpp"
#include "controller/plan/compile.hpp"
#include "controller/run/run_start.hpp"
#include "shared/posix/threads.hpp"
#include "shared/segment/reader.hpp"
#include "shared/wire/cartesian.hpp"
#include "shared/wire/omni.hpp"
#include "tests/servo/support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::loop_test {

using kerf::test::TemporaryFolder;

namespace {

std::string fifo_in(const TemporaryFolder& folder) {
  const std::string fifo = (folder / "gate").string();
  REQUIRE(mkfifo(fifo.c_str(), 0600) == 0);
  return fifo;
}

}  // namespace

TEST_CASE("deadlines keep their distance, and missed ones are skipped and counted") {
  constexpr std::int64_t kPeriodNs = 2'000'000;
  kerf::DeadlineClock clock(kPeriodNs, 0);
  const std::int64_t began = kerf::monotonic_ns();
  for (int i = 0; i < 20; ++i) CHECK(clock.wait_next() >= 0);
  // Never early: twenty deadlines take at least twenty periods, less the start.
  CHECK(kerf::monotonic_ns() - began >= 19 * kPeriodNs);

  const std::uint64_t before = clock.overruns();
  const std::int64_t busy_until = kerf::monotonic_ns() + 10 * kPeriodNs;
  while (kerf::monotonic_ns() < busy_until) {
  }
  const std::int64_t back = kerf::monotonic_ns();
  static_cast<void>(clock.wait_next());
  CHECK(clock.overruns() - before >= 8);
  // Not caught up in a burst: the first deadline is less than a period ago, two more follow it.
  static_cast<void>(clock.wait_next());
  static_cast<void>(clock.wait_next());
  CHECK(kerf::monotonic_ns() - back >= kPeriodNs);
}

TEST_CASE("a gate holds the ticks that were not allowed, and opens if the writer is gone") {
  const TemporaryFolder folder;
  const std::string fifo = fifo_in(folder);
  const std::atomic<bool> stop{false};
  TickGate gate({fifo}, stop);
  const int writer = open(fifo.c_str(), O_WRONLY);
  REQUIRE(writer >= 0);
  const auto allow = [&](std::uint64_t tick) {
    REQUIRE(write(writer, &tick, sizeof tick) == sizeof tick);
  };
  allow(3);
  allow(5);  // the last one counts
  for (std::uint64_t tick = 1; tick <= 5; ++tick) gate.wait_for(tick);

  std::atomic<bool> passed{false};
  auto sixth = std::async(std::launch::async, [&] {
    gate.wait_for(6);
    passed = true;
  });
  CHECK(sixth.wait_for(std::chrono::milliseconds(50)) == std::future_status::timeout);
  CHECK_FALSE(passed);
  allow(6);
  sixth.get();

  allow(4);  // less than it had: nothing more is allowed
  auto seventh = std::async(std::launch::async, [&] { gate.wait_for(7); });
  CHECK(seventh.wait_for(std::chrono::milliseconds(50)) == std::future_status::timeout);
  close(writer);
  seventh.get();
  gate.wait_for(1'000'000);
}

TEST_CASE("a gate opens on a stop request, and is a FIFO or refused") {
  const TemporaryFolder folder;
  const std::string fifo = fifo_in(folder);
  std::atomic<bool> stop{false};
  TickGate gate({fifo}, stop);
  auto waiting = std::async(std::launch::async, [&] { gate.wait_for(1); });
  CHECK(waiting.wait_for(std::chrono::milliseconds(50)) == std::future_status::timeout);
  stop = true;
  waiting.get();

  std::ofstream(folder / "file") << "12345678";
  for (const std::string& wrong : {(folder / "file").string(), (folder / "none").string()}) {
    CHECK_THROWS_AS(TickGate({wrong}, stop), std::runtime_error);
  }
}

namespace {

/// A device that sends nothing, and counts its commands.
struct CountingPort final : kerf::PacketPort {
  std::size_t receive(std::span<std::uint8_t>) noexcept override { return 0; }
  bool send(std::span<const std::uint8_t> packet) noexcept override {
    const auto command = kerf::decode_command(packet);
    ++sent;
    neutral += command && *command == kerf::OmniCommand{} ? 1 : 0;
    pushed += command && !command->motors_on ? 0 : 1;
    return true;
  }
  bool closed() const noexcept override { return false; }
  bool wait(int) noexcept override { return false; }
  std::uint64_t sent = 0, pushed = 0;
  int neutral = 0;
};

/// A driver, the signals of its loop and their watchdog.
struct Watched {
  CountingPort port;
  kerf::OmniDriver driver{port};
  std::atomic<bool> stop{false};
  kerf::LoopSignals signals{stop};
  kerf::Watchdog watchdog{driver, signals};
};

constexpr std::int64_t kMs = 1'000'000;

/// As fast as it goes.
struct NoClock final : kerf::TickSource {
  std::int64_t wait_next() noexcept override { return 0; }
  [[nodiscard]] std::uint64_t overruns() const noexcept override { return 0; }
};

}  // namespace

TEST_CASE("a servo that stands still for 20 ms loses its motors, once per stall") {
  Watched watched;
  auto& [port, driver, stop, signals, watchdog] = watched;
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
  Watched watched;
  auto& [port, driver, stop, signals, watchdog] = watched;
  kerf::ServoOutput push;
  push.motors_on = true;
  push.dac_counts = {100, -200, 300};
  signals.stalled = true;  // the watchdog looked while the tick lasted
  kerf::send_tick(std::span(&push, 1), signals, driver);
  CHECK(port.neutral == 1);
  signals.stalled = false;
  kerf::send_tick(std::span(&push, 1), signals, driver);
  CHECK(port.neutral == 1);
}

TEST_CASE("the watchdog's thread may run on every core but the servo's") {
  const auto cores = kerf::allowed_cores();
  if (cores.size() < 2) {
    MESSAGE("skipped: this process may run on one core only");
    return;
  }
  Watched watched;
  for (const int servo : {cores.front(), cores.back()}) {
    std::jthread watching = kerf::start_watchdog(watched.watchdog, {.cpu = servo});
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

TEST_CASE("a device that says nothing for 2000 ticks ends the loop, and no motor was on") {
  kerf::LoadedScene scene = kerf::test::half_space_scene(32);
  const auto servo = kerf::plan_scene(scene);
  const std::string json = kerf::canonical_json(scene);
  auto segment = kerf::SegmentWriter::create(kerf::segment_spec(scene, json, 0));
  kerf::SegmentServer server("silent-" + std::to_string(getpid()), segment, {.tools = 1});
  servo->take(scene);
  CountingPort port;
  kerf::OmniDriver device(port);
  NoClock clock;
  kerf::Publisher eyes(segment, *servo);
  std::atomic<bool> stop{false};
  kerf::LoopSignals signals{stop};
  kerf::RunRecord record;
  // A loop that forgets its limit would not end: this many ticks do.
  const kerf::LoopLimits limits{.arming_ticks = 10'000};
  CHECK(kerf::run_servo(clock, device, *servo, eyes, server, limits, signals, record) ==
        kerf::EndReason::device_gone);
  CHECK(signals.heartbeat == 2000);
  CHECK(port.sent == 2001);  // the last one on the way out
  CHECK(port.pushed == 0);

  // A position that is not known is published as NaN.
  const auto told = kerf::SegmentReader::map(segment.fd()).latest();
  REQUIRE(told);
  CHECK(told->tick == 2000);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(std::isnan(told->position_mm[i]));
    CHECK(std::isnan(told->velocity_mm_per_s[i]));
  }
}

namespace {

/// A Touch that rests parked for 100 ticks, is then held still in the air, and after `ticks` in all
/// is gone.
struct HeldPort final : kerf::PacketPort {
  explicit HeldPort(std::uint32_t ticks) : last(ticks) {}
  std::size_t receive(std::span<std::uint8_t> packet) noexcept override {
    given = !given;  // one a tick: the driver reads until nothing is left
    if (!given || ++tick > last) return 0;
    kerf::CartesianReport report;
    report.number = tick;
    report.parked = tick < 100;
    report.position_um = {0, 50'000, 0};
    report.homed = report.powered = true;
    const auto bytes = kerf::encode(report);
    std::ranges::copy(bytes, packet.begin());
    return bytes.size();
  }
  bool send(std::span<const std::uint8_t>) noexcept override {
    ++sent;
    return takes;
  }
  bool closed() const noexcept override { return false; }
  bool wait(int) noexcept override { return false; }

  std::uint32_t last, tick = 0;
  std::uint64_t sent = 0;
  bool given = false, takes = true;
};

}  // namespace

TEST_CASE(
    "of two devices one that goes away is a fault of its arm alone, and the last ends the run") {
  kerf::LoadedScene scene = kerf::test::half_space_scene(32);
  scene.device.personality = kerf::Personality::touch;
  scene.device.torque_scale = std::array{1.0, 1.0, 1.0};
  scene.second = kerf::SecondArm{.device = scene.device,
                                 .offset_given = true,
                                 .limits = scene.limits,
                                 .hand_script = {},
                                 .hand_location = {}};
  const auto servo = kerf::plan_scene(scene);
  const std::string json = kerf::canonical_json(scene);
  auto segment = kerf::SegmentWriter::create(kerf::segment_spec(scene, json, 0));
  kerf::SegmentServer server("two-" + std::to_string(getpid()), segment, {.tools = 1, .arms = 2});
  servo->take(scene);
  constexpr std::uint32_t kFirstTicks = 500, kSecondTicks = 900;
  HeldPort first(kFirstTicks), second(kSecondTicks);
  const auto driver = kerf::make_driver(kerf::Personality::touch, first);
  const auto other = kerf::make_driver(kerf::Personality::touch, second);
  NoClock clock;
  kerf::Publisher eyes(segment, *servo);
  std::atomic<bool> stop{false};
  kerf::LoopSignals signals{stop};
  kerf::RunRecord record;
  const kerf::LoopLimits limits{.arming_ticks = 10'000};
  CHECK(kerf::run_servo(clock, {*driver, other.get()}, *servo, eyes, server, limits, signals,
                        record) == kerf::EndReason::device_gone);
  CHECK(signals.heartbeat == kSecondTicks + limits.gone_ticks);
  const auto names = [](const kerf::EventList& faults) {
    std::string list;
    for (const auto& fault : faults.kept()) list += std::string(fault.name) + " ";
    return list;
  };
  CHECK(names(record.faults) == "stale_input device_gone ");
  CHECK(names(record.second.faults) == "stale_input device_gone ");
  CHECK(record.faults.first[0].tick < record.second.faults.first[0].tick);
  CHECK(record.stale_ticks == 0);  // those since it went are no losses
  CHECK(record.second.stale_ticks == 0);
  CHECK(record.has_faults());

  // Every tick has a record of each arm, of the same tick.
  const auto reader = kerf::SegmentReader::map(segment.fd());
  CHECK(reader.info().arms == 2);
  kerf::TickRecord a, b;
  for (std::uint64_t i = 0; i < 1000; ++i) {
    REQUIRE(reader.state_at(i, a) == kerf::ReadState::ok);
    REQUIRE(reader.state_at(i, b, 1) == kerf::ReadState::ok);
    REQUIRE(a.tick == b.tick);
    REQUIRE((a.stale != 0) == (i >= kFirstTicks));
    REQUIRE((b.stale != 0) == (i >= kSecondTicks));
  }
}

TEST_CASE("every device is released, though one before it takes nothing") {
  HeldPort first(0), second(0);
  first.takes = false;
  const auto driver = kerf::make_driver(kerf::Personality::touch, first);
  const auto other = kerf::make_driver(kerf::Personality::touch, second);
  const kerf::Devices devices(*driver, other.get());
  CHECK_FALSE(devices.release());
  CHECK(second.sent == 1);
  CHECK_FALSE(devices.stay_released());
  CHECK(second.sent == 2);
  CHECK_FALSE(devices.release_for_good());
  CHECK(second.sent > 2);

  std::atomic<bool> stop{false};
  kerf::LoopSignals signals{stop};
  kerf::Watchdog watchdog(devices, signals);
  signals.heartbeat = 1;
  watchdog.look(1);
  const std::uint64_t before = second.sent;
  watchdog.look(25 * kMs);
  CHECK(second.sent == before + 1);
}

}  // namespace kerf::loop_test
