// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hil/device/emulator.hpp"
#include "hil/device/packet_device.hpp"
#include "hil/front/socket_servers.hpp"
#include "hil/program/emulator_options.hpp"
#include "hil/script/fault_script.hpp"
#include "hil/script/faulty_device.hpp"

/// The device of kerf-emulator: model, hand and faults for each client, and the socket of a window
/// that leads the hand.
namespace kerf {

/// The socket at which a window leads the hand: packets of `HandTarget`.
///
/// Once the hand is at its start, one window at a time is accepted; a second one gets `taken` and
/// is closed, and one of another user is refused. A packet that is no target is dropped and
/// counted. Never waits. One thread.
class HandServer {
 public:
  /// Throws `HilError`; see SeqpacketServer.
  explicit HandServer(const std::string& path) : server_(path, "--hand-socket") {}

  /// Passes the newest target to the emulator's hand, and `release` if the window has gone. Call
  /// between two polls of the host; `cycles` bus cycles have passed since the last call.
  void lead(Emulator& emulator, int cycles) noexcept;

  [[nodiscard]] std::uint64_t targets() const noexcept { return targets_; }
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }

 private:
  void accept_window() noexcept;

  SeqpacketServer server_;
  std::optional<SeqpacketLink> window_;
  std::int64_t since_accept_ = 0;  ///< bus cycles
  std::uint64_t targets_ = 0, refused_ = 0;
};

/// The device model of the options; plant parameters that they leave out come from the identified
/// device, then from the hand script. Throws `HilError` for an impossible plant.
[[nodiscard]] std::unique_ptr<DeviceModel> make_device(const EmulatorOptions& options,
                                                       const PlantValues& of_script,
                                                       const PlantValues& of_identified = {});

/// The emulated device with its hand and its faults. All three restart for each new client. One
/// thread.
class EmulatedDevice final : public PacketDevice {
 public:
  /// `options` outlive it. Reads the scripts; throws `HilError`.
  explicit EmulatedDevice(const EmulatorOptions& options);

  void receive(std::span<const std::uint8_t> packet) noexcept override { faulty_->receive(packet); }
  void advance(int cycles) noexcept override;
  [[nodiscard]] bool hung_up() const noexcept override { return faulty_->hung_up(); }
  [[nodiscard]] std::span<const std::uint8_t> next_packet() noexcept override {
    return faulty_->next_packet();
  }

  /// For a new client. Allocates.
  void renew();

  /// The socket of a window that leads the hand; empty without `--hand-socket`.
  [[nodiscard]] const std::optional<HandServer>& leader() const noexcept { return leader_; }
  [[nodiscard]] const DeviceModel& model() const noexcept { return emulator_->model(); }
  /// Of all clients together.
  [[nodiscard]] EmulatorStats stats() const noexcept {
    return joined(earlier_, emulator_->stats());
  }
  /// Packets that faults kept from them.
  [[nodiscard]] std::uint64_t withheld() const noexcept { return withheld_ + faulty_->withheld(); }
  /// The faults that the last client has met.
  [[nodiscard]] std::vector<InjectedFault> injected() const { return faulty_->injected(); }

 private:
  [[nodiscard]] static EmulatorStats joined(const EmulatorStats& earlier,
                                            const EmulatorStats& later) noexcept;

  const EmulatorOptions& options_;
  std::optional<HandScript> hand_;
  PlantValues identified_;
  FaultScript faults_;
  std::optional<HandServer> leader_;
  std::optional<Emulator> emulator_;
  std::optional<FaultyDevice> faulty_;
  EmulatorStats earlier_;
  std::uint64_t withheld_ = 0;
};

}  // namespace kerf
