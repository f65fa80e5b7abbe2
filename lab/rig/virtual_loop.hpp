// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>

#include "controller/device/device_driver.hpp"
#include "controller/device/port/packet_port.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/compile.hpp"
#include "hil/device/packet_device.hpp"
#include "lab/rig/direct_port.hpp"

/// A device, its driver and the servo step in one process and in virtual time.
namespace kerf {

/// The loop of a controller whose clock is that of the device: bus cycles, and a servo step after
/// the last cycle of each tick. The rate of the scene divides that of the bus.
class VirtualLoop {
 public:
  /// Starts the driver. `port` is the driver's view of `wire`, which both outlive this object. The
  /// servo takes the volumes of `scene`.
  VirtualLoop(LoadedScene& scene, DirectPort& wire, PacketPort& port)
      : wire_(wire),
        servo_(compile(scene)),
        driver_(make_driver(scene.device.personality, port, scene.device.encoder_sign,
                            scene.servo.rate_hz)),
        cycles_per_tick_(kCyclesPerSecond / scene.servo.rate_hz) {
    driver_->start();
  }
  VirtualLoop(LoadedScene& scene, DirectPort& wire) : VirtualLoop(scene, wire, wire) {}

  /// One bus cycle. Returns true if it ends a tick: a step is due.
  [[nodiscard]] bool cycle() {
    wire_.cycle();
    return ++cycles_ % cycles_per_tick_ == 0;
  }
  /// Reads the newest report, steps the servo and commands the device.
  ServoOutput step() {
    const DeviceReport report = driver_->read();
    const auto begin = std::chrono::steady_clock::now();
    const ServoOutput out = servo_->step(report);
    const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - begin;
    step_us_ = took.count();
    driver_->command(out);
    return out;
  }
  /// Cycles up to the end of the tick, then a step.
  ServoOutput tick() {
    while (!cycle()) {
    }
    return step();
  }

  [[nodiscard]] std::int64_t cycles() const noexcept { return cycles_; }
  /// Time of the last servo step, without the driver.
  [[nodiscard]] double step_us() const noexcept { return step_us_; }
  [[nodiscard]] CompiledScene& servo() noexcept { return *servo_; }
  [[nodiscard]] DeviceDriver& driver() noexcept { return *driver_; }

 private:
  DirectPort& wire_;
  std::unique_ptr<CompiledScene> servo_;
  std::unique_ptr<DeviceDriver> driver_;
  int cycles_per_tick_;
  std::int64_t cycles_ = 0;
  double step_us_ = 0;
};

}  // namespace kerf
