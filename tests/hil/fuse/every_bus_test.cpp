// SPDX-License-Identifier: Apache-2.0
// The same above each of the three buses: the emulator's program, sessions in turn, a controller
// that crashes, and a sample of the fault matrix.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/loop/motor_guard.hpp"
#include "hil/script/faulty_device.hpp"
#include "lab/safety/contract.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/woodenhaptics.hpp"
#include "tests/hil/fuse/bus_session.hpp"
#include "tests/hil/run_emulator.hpp"
#include "tests/support/child.hpp"

namespace kerf::every_bus_test {
namespace {

using kerf::test::EmulatorRun;
using kerf::test::kGoOn;
using kerf::test::kKilledBySignal;
using kerf::test::run_emulator;
using kerf::test::TemporaryFolder;

struct Device {
  Personality personality;
  std::string options;  ///< of kerf-emulator
  const char* name;
  const char* bus;
  const char* node;
};
const Device kDevices[] = {
    {Personality::omni, "", "omni", "fw", "fw1"},
    {Personality::falcon, " --firmware-runs", "falcon", "usb", "usb"},
    {Personality::woodenhaptics, "", "woodenhaptics", "hid", "hidraw0"},
};

std::string fuse_line(const TemporaryFolder& folder, const std::string& device) {
  return "--front fuse --mount " + folder.path().string() + " --priority 0 --personality " + device;
}

}  // namespace

// ---- the program ----

TEST_CASE("kerf-emulator --front fuse serves one client, ends with it and unmounts") {
  for (const Device& device : kDevices) {
    CAPTURE(device.name);
    const TemporaryFolder folder;
    EmulatorRun run;
    std::thread emulator(
        [&] { run = run_emulator(fuse_line(folder, device.name) + device.options); });
    const std::string node = folder / device.node;
    {
      const auto port = kerf::open_port(device.bus + (":" + node), {}, 5000, kGoOn);
      const auto driver = kerf::make_driver(device.personality, *port);
      driver->start();
      int fresh = 0;
      for (int tick = 0; tick < 1000 && fresh < 10; ++tick) {
        static_cast<void>(driver->wait(10));
        fresh += driver->read().fresh ? 1 : 0;
        driver->command({});
      }
      CHECK(fresh == 10);
    }
    emulator.join();
    CHECK(run.code == 0);
    CHECK(run.err == "");
    CHECK(run.out == "kerf-emulator: " + std::string(device.name) + " at " + node + "\n");
    CHECK(folder.count() == 0);
  }
}

TEST_CASE("--seconds ends an emulator whose node no client opens") {
  for (const std::string device : {"omni", "omni --lockstep", "falcon", "woodenhaptics"}) {
    CAPTURE(device);
    const TemporaryFolder folder;
    CHECK(run_emulator(fuse_line(folder, device) + " --stay --seconds 0.1").code == 0);
    CHECK(folder.count() == 0);
  }
}

TEST_CASE("with --stay the second client finds the hand where the first one found it") {
  const TemporaryFolder folder;
  std::atomic<bool> stop{false};
  EmulatorRun run;
  std::thread emulator([&] {
    run = run_emulator(fuse_line(folder, "omni --lockstep --stay --hand " KERF_HANDS "/touch.toml"),
                       stop);
  });
  for (int client = 0; client < 2; ++client) {
    CAPTURE(client);
    kerf::FirewireOptions options;
    options.where = folder.path();
    kerf::FirewirePort port(options, 5000, kGoOn);
    kerf::OmniDriver driver(port);
    kerf::DeviceReport report = driver.read();
    REQUIRE(report.fresh);
    CHECK(report.parked);
    for (int tick = 0; tick < 4000 && report.parked; ++tick) {
      driver.command({});
      report = driver.read();
    }
    CHECK_FALSE(report.parked);
  }
  stop = true;
  emulator.join();
  CHECK(run.code == 0);
}

TEST_CASE("three sessions, one after the other, on one node") {
  const auto check = [](const std::string& bus, Personality personality) {
    CAPTURE(bus);
    for (int i = 0; i < 3; ++i) {
      const auto port = kerf::open_port(bus, {}, 0, kGoOn);
      const auto driver = kerf::make_driver(personality, *port);
      driver->start();
      driver->command({});
      CHECK(driver->wait(200));
      CHECK(driver->read().fresh);
    }
  };
  const kerf::test::MountedNode omni;
  check("fw:" + omni.folder(), Personality::omni);  // the only device in there
  const kerf::test::MountedFalcon falcon;
  check(falcon.port(), Personality::falcon);
  const kerf::test::MountedArm arm;
  check(arm.port(), Personality::woodenhaptics);
}

// ---- a controller that dies with torque on the motors ----

namespace {

/// The child commands torque over 100 reports and then ends by `way_out`. Returns its end.
template <class WayOut>
int end_after_torque(const std::string& bus, Personality personality, const WayOut& way_out) {
  return kerf::test::end_in_child([&] {
    const auto port = kerf::open_port(bus, {}, 1000, kGoOn);
    const auto driver = kerf::make_driver(personality, *port);
    driver->start();
    kerf::MotorGuard guard(*driver);
    const kerf::HandlerStack handlers = guard.guard_stack();
    ServoOutput output;
    output.dac_counts = {100, 100, 100};
    output.motors_on = true;
    int fresh = 0;  // so that a device on a busy machine has had its commands
    for (int tick = 0; tick < 5000 && fresh < 100; ++tick) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      fresh += driver->read().fresh ? 1 : 0;
      driver->command(output);
    }
    way_out();
  });
}

template <class Mounted, class WayOut>
void check_motors_off(Mounted& device, Personality personality, const WayOut& way_out, int end) {
  CHECK(end_after_torque(device.port(), personality, way_out) == end);
  device.stop();
  CHECK(device.emulator().stats().peak_motor_force_n > 0);
  CHECK(norm(device.emulator().model().motor_force_n()) == 0);
}

}  // namespace

TEST_CASE("the motors of a device are off after the end of its controller, however it ends") {
  kerf::FirewireSettings settings;
  settings.clock = kerf::BusClock::real_time();
  // The last packet must leave before the kernel takes the stream down with the process.
  const auto check_omni = [&](auto way_out, int end) {
    kerf::test::MountedNode omni(settings);
    check_motors_off(omni, Personality::omni, way_out, end);
  };
  check_omni([] {}, 0);
  check_omni([] { std::raise(SIGABRT); }, kKilledBySignal + SIGABRT);
#ifndef KERF_SANITIZED  // they take this one for themselves
  check_omni([] { std::raise(SIGSEGV); }, kKilledBySignal + SIGSEGV);
#endif
  kerf::test::MountedFalcon falcon({.firmware_runs = true}, {}, std::nullopt);
  check_motors_off(
      falcon, Personality::falcon, [] { std::abort(); }, kKilledBySignal + SIGABRT);
}

// ---- the fault matrix ----

namespace {

/// Of the device's end of the link: KERF_LINK_ENDS=20 in .ci/all.
int link_ends() {
  const char* const text = std::getenv("KERF_LINK_ENDS");  // NOLINT(concurrency-mt-unsafe)
  return text != nullptr ? std::atoi(text) : 3;
}

/// Faults of reports (./kerf lab faults), one after the other; the last one latches a fault.
const kerf::FaultScript kSample{
    .faults = {{.kind = FaultKind::lose, .at_s = 0.05, .for_s = 0.1, .every = 2},
               {.kind = FaultKind::duplicate, .at_s = 0.2, .for_s = 0.1},
               {.kind = FaultKind::reorder, .at_s = 0.35, .for_s = 0.1, .every = 3},
               {.kind = FaultKind::truncate, .at_s = 0.5, .for_s = 0.1, .every = 3},
               {.kind = FaultKind::delay, .at_s = 0.65, .for_s = 0.1, .every = 2, .ms = 3},
               {.kind = FaultKind::lose, .at_s = 0.8, .for_s = 0.05}}};

constexpr int kTicksAfterFault = 100;
constexpr int kMostTicks = 8000;

/// The device with its faults, watched by the matrix's own monitor of the contract. The node's
/// thread advances it; the host's end of the bus is watched from the servo's.
class WatchedDevice final : public kerf::PacketDevice {
 public:
  WatchedDevice(Emulator& emulator, const kerf::LoadedScene& scene, const kerf::FaultScript& script)
      : emulator_(emulator), device_(emulator, script), contract_(scene, true, outcome_) {}

  void receive(std::span<const std::uint8_t> packet) noexcept override { device_.receive(packet); }
  void advance(int cycles) noexcept override {
    for (int i = 0; i < cycles; ++i) {
      device_.advance(1);
      const std::scoped_lock lock(mutex_);
      time_ms_ = static_cast<double>(emulator_.stats().cycles) * 1000 / kerf::kCyclesPerSecond;
      const auto& model = emulator_.model();
      contract_.cycle(time_ms_, {model.motor_force_n(), model.docked()});
    }
  }
  std::span<const std::uint8_t> next_packet() noexcept override { return device_.next_packet(); }

  void observe_report(std::span<const std::uint8_t> packet) {
    const std::scoped_lock lock(mutex_);
    contract_.listened(time_ms_);
    if (!packet.empty()) contract_.reported(time_ms_, packet);
  }
  void observe_command(std::span<const std::uint8_t> packet) {
    const std::scoped_lock lock(mutex_);
    contract_.commanded(time_ms_, packet);
  }

  // After the last call of the others.
  [[nodiscard]] const kerf::faults::FaultOutcome& outcome() const { return outcome_; }
  [[nodiscard]] std::size_t faults_begun() const { return device_.begun(); }

 private:
  Emulator& emulator_;
  kerf::FaultyDevice device_;
  std::mutex mutex_;
  double time_ms_ = 0;
  kerf::faults::FaultOutcome outcome_;
  kerf::faults::SafetyMonitor contract_;
};

/// The host's end of a bus.
class WatchedPort final : public kerf::PacketPort {
 public:
  WatchedPort(kerf::PacketPort& port, WatchedDevice& device) : port_(port), device_(device) {}

  std::size_t receive(std::span<std::uint8_t> out) noexcept override {
    const std::size_t size = port_.receive(out);
    device_.observe_report(out.first(std::min(size, out.size())));
    return size;
  }
  bool send(std::span<const std::uint8_t> packet) noexcept override {
    device_.observe_command(packet);
    return port_.send(packet);
  }
  bool send_now(std::span<const std::uint8_t> packet) noexcept override {
    device_.observe_command(packet);
    return port_.send_now(packet);
  }
  [[nodiscard]] bool closed() const noexcept override { return port_.closed(); }
  [[nodiscard]] bool wait(int milliseconds) noexcept override { return port_.wait(milliseconds); }
  [[nodiscard]] std::vector<kerf::LinkCounter> counters() const override {
    return port_.counters();
  }

 private:
  kerf::PacketPort& port_;
  WatchedDevice& device_;
};

/// Plays the sample through the bus of the device: the Omni's is in lock-step, the others' clocks
/// are held. `serve(device, clock)` makes the node.
template <class Serve>
void play(const Device& which, std::unique_ptr<kerf::DeviceModel> model, Serve serve,
          const kerf::FaultScript& script) {
  CAPTURE(which.name);
  Emulator emulator(std::move(model), kerf::test::pressing_hand());
  kerf::LoadedScene scene = kerf::test::firm_half_space();
  scene.device.personality = which.personality;
  kerf::test::HeldClock clock;
  WatchedDevice device(emulator, scene, script);
  kerf::test::ReadyServo servo(which.personality, scene);
  const auto served = serve(device, clock);
  int pushing = 0, in_fault = 0;
  {
    const auto port = kerf::open_port(which.bus + (":" + served->path()), {}, 1000, kGoOn);
    WatchedPort watched(*port, device);
    const bool lockstep = which.personality == Personality::omni;
    kerf::test::ServoSession session(std::move(servo), watched, lockstep ? nullptr : &clock);
    for (int tick = 0; tick < kMostTicks && in_fault < kTicksAfterFault; ++tick) {
      const ServoOutput output = session.tick().output;
      pushing += output.contact ? 1 : 0;
      in_fault += output.fault == kerf::Fault::stale_input ? 1 : 0;
    }
  }
  served->stop();
  const auto& outcome = device.outcome();
  for (const std::string& violation : outcome.violations) MESSAGE(violation);
  CHECK(outcome.violation_count == 0);
  CHECK(device.faults_begun() == script.faults.size());
  CHECK(outcome.device_peak_n > 0.05);
  CHECK(outcome.device_peak_n < 1.05 * scene.limits.force_n);
  CHECK(norm(emulator.model().motor_force_n()) == 0);
  CHECK(pushing > script.faults.back().at_s * 1000 / 3);
  CHECK(in_fault == kTicksAfterFault);
}

}  // namespace

namespace {

void play_on_each_bus(const kerf::FaultScript& script) {
  using kerf::test::become_device;
  using kerf::test::HeldClock;
  play(
      kDevices[0], std::make_unique<kerf::OmniModel>(),
      [](kerf::PacketDevice& device, HeldClock& /*clock*/) {
        return std::make_unique<kerf::test::MountedDevice>(kerf::FirewireSettings{}, device);
      },
      script);
  play(
      kDevices[1], std::make_unique<kerf::FalconModel>(),
      [](kerf::PacketDevice& device, HeldClock& clock) {
        return std::make_unique<kerf::test::ServedNode<kerf::UsbfsNode>>(
            "usb", become_device,
            kerf::FtdiFalcon::Settings{.firmware_runs = true, .clock = &clock},
            std::vector<kerf::ScriptedUsbFault>{}, device);
      },
      script);
  play(
      kDevices[2], std::make_unique<kerf::WoodenModel>(),
      [](kerf::PacketDevice& device, HeldClock& clock) {
        return std::make_unique<kerf::test::ServedNode<kerf::HidrawNode>>(
            "hidraw0", become_device, kerf::WoodenHid::Settings{.clock = &clock}, device);
      },
      script);
}

}  // namespace

TEST_CASE("the sample of faults breaks no rule on the bus of each device") {
  play_on_each_bus(kSample);
}

TEST_CASE("whenever the device ends its side of a bus, the motors are off in time") {
  for (int end = 0; end < link_ends(); ++end) {
    CAPTURE(end);
    play_on_each_bus({.faults = {{.kind = FaultKind::hang_up, .at_s = 0.02 + 0.037 * end}}});
  }
}

}  // namespace kerf::every_bus_test
