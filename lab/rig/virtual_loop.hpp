// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "controller/device/device_driver.hpp"
#include "controller/device/port/packet_port.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/compile.hpp"
#include "hil/device/packet_device.hpp"

/// A device, its driver and the servo step in one process and in virtual time.
namespace kerf {

/// The port to an emulated device in the same process. `device` outlives it.
class DirectPort final : public PacketPort {
 public:
  explicit DirectPort(PacketDevice& device) : device_(device) {}

  /// One bus cycle of the device; its packets wait here.
  void cycle() {
    device_.advance(1);
    for (auto packet = device_.next_packet(); !packet.empty(); packet = device_.next_packet()) {
      waiting_.emplace_back(packet.begin(), packet.end());
    }
  }

  std::size_t receive(std::span<std::uint8_t> out) noexcept override {
    if (waiting_.empty()) return 0;
    const std::vector<std::uint8_t> packet = std::move(waiting_.front());
    waiting_.pop_front();
    std::copy_n(packet.begin(), std::min(packet.size(), out.size()), out.begin());
    return packet.size();
  }
  bool send(std::span<const std::uint8_t> packet) noexcept override {
    device_.receive(packet);
    return true;
  }
  [[nodiscard]] bool closed() const noexcept override {
    return waiting_.empty() && device_.hung_up();
  }
  [[nodiscard]] bool wait(int) noexcept override { return !waiting_.empty(); }

 private:
  PacketDevice& device_;
  std::deque<std::vector<std::uint8_t>> waiting_;
};

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
