// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <utility>
#include <vector>

#include "controller/device/port/packet_port.hpp"
#include "hil/device/falcon.hpp"
#include "hil/device/omni.hpp"
#include "hil/device/packet_device.hpp"
#include "hil/device/wooden.hpp"
#include "shared/wire/personality.hpp"

/// An emulated device in the same process: its port, and the torque scale of its unit.
namespace kerf {

/// N mm per motor count of the emulated unit: a scene's `device.torque_scale`.
[[nodiscard]] inline std::array<double, 3> torque_scale_of(Personality personality) {
  switch (personality) {
    case Personality::falcon:
      return FalconParams().torque_scale();
    case Personality::woodenhaptics:
      return WoodenParams().torque_scale();
    case Personality::omni:
      break;
  }
  return OmniParams().torque_scale();
}

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
  [[nodiscard]] bool closed() const noexcept override { return false; }
  [[nodiscard]] bool wait(int) noexcept override { return !waiting_.empty(); }

 private:
  PacketDevice& device_;
  std::deque<std::vector<std::uint8_t>> waiting_;
};

}  // namespace kerf
