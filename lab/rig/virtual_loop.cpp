// SPDX-License-Identifier: Apache-2.0
#include "lab/rig/virtual_loop.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

namespace kerf {

void DirectPort::cycle() {
  device_.advance(1);
  for (auto packet = device_.next_packet(); !packet.empty(); packet = device_.next_packet()) {
    waiting_.emplace_back(packet.begin(), packet.end());
  }
}

std::size_t DirectPort::receive(std::span<std::uint8_t> out) noexcept {
  if (waiting_.empty()) return 0;
  const std::vector<std::uint8_t> packet = std::move(waiting_.front());
  waiting_.pop_front();
  std::copy_n(packet.begin(), std::min(packet.size(), out.size()), out.begin());
  return packet.size();
}

VirtualLoop::VirtualLoop(LoadedScene& scene, DirectPort& wire, PacketPort& port)
    : wire_(wire),
      servo_(compile(scene)),
      driver_(make_driver(scene.device.personality, port, scene.device.encoder_sign,
                          scene.servo.rate_hz)),
      cycles_per_tick_(kCyclesPerSecond / scene.servo.rate_hz) {
  driver_->start();
}

bool VirtualLoop::cycle() {
  wire_.cycle();
  return ++cycles_ % cycles_per_tick_ == 0;
}

ServoOutput VirtualLoop::step() {
  const DeviceReport report = driver_->read();
  const auto begin = std::chrono::steady_clock::now();
  const ServoOutput out = servo_->step(report);
  const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - begin;
  step_us_ = took.count();
  driver_->command(out);
  return out;
}

ServoOutput VirtualLoop::tick() {
  while (!cycle()) {
  }
  return step();
}

}  // namespace kerf
