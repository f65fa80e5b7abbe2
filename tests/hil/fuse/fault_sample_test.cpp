// SPDX-License-Identifier: Apache-2.0
// A sample of the fault matrix (./kerf lab faults) through each device's own bus, with the matrix's
// own watch, the contract. The Omni's bus is in lock-step, the others' clocks are held.
#include <algorithm>
#include <cstddef>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "hil/device/omni.hpp"
#include "hil/script/faulty_device.hpp"
#include "lab/safety/contract.hpp"
#include "tests/hil/fuse/usb_session.hpp"

namespace {

using kerf::DeviceFault;
using kerf::Emulator;
using kerf::FaultKind;
using kerf::Personality;
using kerf::ServoOutput;
using kerf::test::kGoOn;

/// What may go wrong with reports, one after the other; the last one latches a fault.
const kerf::FaultScript kSample{
    .faults = {{.kind = FaultKind::lose, .at_s = 0.05, .for_s = 0.1, .every = 2},
               {.kind = FaultKind::duplicate, .at_s = 0.2, .for_s = 0.1},
               {.kind = FaultKind::reorder, .at_s = 0.35, .for_s = 0.1, .every = 3},
               {.kind = FaultKind::truncate, .at_s = 0.5, .for_s = 0.1, .every = 3},
               {.kind = FaultKind::delay, .at_s = 0.65, .for_s = 0.1, .every = 2, .ms = 3},
               {.kind = FaultKind::lose, .at_s = 0.8, .for_s = 0.05}}};
constexpr int kTicksAfterFault = 100;
constexpr int kMostTicks = 8000;

/// The device with its faults. The node's thread moves it on, the host's end of the bus is watched
/// from the servo's.
class WatchedDevice final : public kerf::PacketDevice {
 public:
  WatchedDevice(Emulator& emulator, const kerf::LoadedScene& scene)
      : emulator_(emulator), device_(emulator, kSample), contract_(scene, true, outcome_) {}

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

  void told(std::span<const std::uint8_t> packet) {
    const std::scoped_lock lock(mutex_);
    contract_.listened(time_ms_);
    if (!packet.empty()) contract_.reported(time_ms_, packet);
  }
  void asked(std::span<const std::uint8_t> packet) {
    const std::scoped_lock lock(mutex_);
    contract_.commanded(time_ms_, packet);
  }

  // When nobody calls any more.
  [[nodiscard]] const kerf::faults::Outcome& outcome() const { return outcome_; }
  [[nodiscard]] std::size_t faults_begun() const { return device_.begun(); }

 private:
  Emulator& emulator_;
  kerf::FaultyDevice device_;
  std::mutex mutex_;
  double time_ms_ = 0;
  kerf::faults::Outcome outcome_;
  kerf::faults::SafetyMonitor contract_;
};

/// The host's end of a bus.
class WatchedPort final : public kerf::PacketPort {
 public:
  WatchedPort(kerf::PacketPort& port, WatchedDevice& device) : port_(port), device_(device) {}

  std::size_t receive(std::span<std::uint8_t> out) noexcept override {
    const std::size_t size = port_.receive(out);
    device_.told(out.first(std::min(size, out.size())));
    return size;
  }
  bool send(std::span<const std::uint8_t> packet) noexcept override {
    device_.asked(packet);
    return port_.send(packet);
  }
  bool send_now(std::span<const std::uint8_t> packet) noexcept override {
    device_.asked(packet);
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

/// Plays the sample; `serve(device, clock)` makes the node.
template <class Serve>
void play(Personality personality, Emulator& emulator, const std::string& bus, Serve serve) {
  kerf::LoadedScene scene = kerf::test::firm_half_space();
  scene.device.personality = personality;
  kerf::test::HeldClock clock;
  WatchedDevice device(emulator, scene);
  kerf::test::ReadyServo servo(personality, scene);
  const auto served = serve(device, clock);
  int pushing = 0, in_fault = 0;
  {
    const auto port = kerf::open_port(bus + ":" + served->path(), {}, 1000, kGoOn);
    WatchedPort watched(*port, device);
    kerf::test::ServoSession session(std::move(servo), watched, clock);
    for (int tick = 0; tick < kMostTicks && in_fault < kTicksAfterFault; ++tick) {
      const bool lockstep = personality == Personality::omni;
      const ServoOutput output = (lockstep ? session.step() : session.tick()).output;
      pushing += output.contact ? 1 : 0;
      in_fault += output.fault == kerf::Fault::stale_input ? 1 : 0;
    }
  }
  served->stop();
  const auto& outcome = device.outcome();
  for (const std::string& violation : outcome.violations) MESSAGE(violation);
  CHECK(outcome.violation_count == 0);
  CHECK(device.faults_begun() == kSample.faults.size());
  CHECK(outcome.device_peak_n > 0.05);
  CHECK(outcome.device_peak_n < 1.05 * scene.limits.force_n);
  CHECK(norm(emulator.model().motor_force_n()) == 0);
  CHECK(pushing > 300);
  CHECK(in_fault == kTicksAfterFault);
}

}  // namespace

TEST_CASE("the sample of faults breaks no rule with the Omni over FireWire") {
  Emulator emulator({}, kerf::test::pressing_hand());
  play(Personality::omni, emulator, "fw",
       [](kerf::PacketDevice& device, kerf::test::HeldClock& /*clock*/) {
         return std::make_unique<kerf::test::MountedDevice>(kerf::FirewireSettings{}, device);
       });
}

TEST_CASE("the sample of faults breaks no rule with the Falcon over USB") {
  Emulator emulator(std::make_unique<kerf::FalconModel>(), kerf::test::pressing_hand());
  play(Personality::falcon, emulator, "usb",
       [](kerf::PacketDevice& device, kerf::test::HeldClock& clock) {
         return std::make_unique<kerf::test::ServedNode<kerf::UsbfsNode>>(
             "usb", kerf::test::become_device,
             kerf::FtdiFalcon::Settings{.firmware_runs = true, .clock = &clock},
             std::vector<kerf::ScriptedUsbFault>{}, device);
       });
}

TEST_CASE("the sample of faults breaks no rule with WoodenHaptics over HID") {
  Emulator emulator(std::make_unique<kerf::WoodenModel>(), kerf::test::pressing_hand());
  play(Personality::woodenhaptics, emulator, "hid",
       [](kerf::PacketDevice& device, kerf::test::HeldClock& clock) {
         return std::make_unique<kerf::test::ServedNode<kerf::HidrawNode>>(
             "hidraw0", kerf::test::become_device, kerf::WoodenHid::Settings{.clock = &clock},
             device);
       });
}
