// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "hil/devmodel/emulator.hpp"
#include "hil/devmodel/packet_device.hpp"
#include "hil/fault/faulty_device.hpp"
#include "hil/front/hand_server.hpp"
#include "hil/program/emulator_options.hpp"
#include "hil/script/fault_script.hpp"

namespace kerf {

/// The device model that the options describe, and where they say nothing of its plant, the hand
/// script. Throws `HilError` for a plant that cannot be.
[[nodiscard]] std::unique_ptr<DeviceModel> make_device(const EmulatorOptions& options,
                                                       const PlantValues& of_script);

/// The device of kerf-emulator with its hand and its faults; each client gets all three from their
/// start, as if it were the first one. One thread.
class EmulatedDevice final : public PacketDevice {
 public:
  /// `options` outlive it. Reads the scripts; throws `HilError`.
  explicit EmulatedDevice(const EmulatorOptions& options);

  void receive(std::span<const std::uint8_t> packet) noexcept override { faulty_->receive(packet); }
  void advance(int cycles) noexcept override;
  [[nodiscard]] std::span<const std::uint8_t> next_packet() noexcept override {
    return faulty_->next_packet();
  }

  /// For a new client. Allocates.
  void renew();

  /// Where a window leads the hand; none without `--hand-socket`.
  [[nodiscard]] const std::optional<HandServer>& leader() const noexcept { return leader_; }
  [[nodiscard]] const DeviceModel& model() const noexcept { return emulator_->model(); }
  /// Of all clients together.
  [[nodiscard]] EmulatorStats stats() const noexcept {
    return joined(earlier_, emulator_->stats());
  }
  /// Packets that faults kept from them.
  [[nodiscard]] std::uint64_t withheld() const noexcept { return withheld_ + faulty_->withheld(); }
  /// What the fault script has done to the last client.
  [[nodiscard]] std::vector<InjectedFault> injected() const { return faulty_->injected(); }

 private:
  [[nodiscard]] static EmulatorStats joined(const EmulatorStats& earlier,
                                            const EmulatorStats& later) noexcept;

  const EmulatorOptions& options_;
  std::optional<HandScript> hand_;
  FaultScript faults_;
  std::optional<HandServer> leader_;
  std::optional<Emulator> emulator_;
  std::optional<FaultyDevice> faulty_;
  EmulatorStats earlier_;
  std::uint64_t withheld_ = 0;
};

}  // namespace kerf
