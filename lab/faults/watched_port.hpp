// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/device/port/packet_port.hpp"
#include "lab/faults/contract.hpp"

namespace kerf::faults {

/// The host's end of the wire: passes every packet on, and shows it to the contract, both ways.
/// `port`, `contract` and `time_ms` outlive it.
class WatchedPort final : public PacketPort {
 public:
  WatchedPort(PacketPort& port, Contract& contract, const double& time_ms) noexcept
      : port_(port), contract_(contract), time_ms_(time_ms) {}

  std::size_t receive(std::span<std::uint8_t> out) noexcept override {
    contract_.listened(time_ms_);
    const std::size_t size = port_.receive(out);
    if (size > 0 && size <= out.size()) contract_.reported(time_ms_, out.first(size));
    return size;
  }
  bool send(std::span<const std::uint8_t> packet) noexcept override {
    contract_.commanded(time_ms_, packet);
    return port_.send(packet);
  }
  [[nodiscard]] bool closed() const noexcept override { return port_.closed(); }
  [[nodiscard]] bool wait(int milliseconds) noexcept override { return port_.wait(milliseconds); }

 private:
  PacketPort& port_;
  Contract& contract_;
  const double& time_ms_;
};

}  // namespace kerf::faults
