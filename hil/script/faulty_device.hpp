// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "hil/device/emulator.hpp"
#include "hil/device/packet_device.hpp"
#include "hil/script/fault_script.hpp"

namespace kerf {

/// A fault of a script that has begun, and the number of its effects.
struct InjectedFault {
  FaultKind kind = FaultKind::lose;
  bool of_commands = false;
  std::int64_t at_cycle = 0;  ///< of the device, from its start
  std::uint64_t changed = 0;  ///< packets and readings that it changed; 1 for a host that is late
};

/// An emulated device whose packets and sensors go wrong by a script; an empty script changes
/// nothing. The same script and the same calls give the same faults. One thread.
class FaultyDevice final : public PacketDevice {
 public:
  FaultyDevice(Emulator& device, const FaultScript& script);

  void receive(std::span<const std::uint8_t> packet) noexcept override;
  void advance(int cycles) noexcept override;
  [[nodiscard]] std::span<const std::uint8_t> next_packet() noexcept override;

  [[nodiscard]] bool hung_up() const noexcept override;

  /// Returns true if a fault makes the host stand still now; the caller keeps it from running then.
  [[nodiscard]] bool host_is_late() const noexcept;
  /// A fault of a service (`is_of_service`) that has begun or ended in the last cycles, each once.
  struct ServiceChange {
    FaultKind kind{};
    bool begins = true;
  };
  [[nodiscard]] std::optional<ServiceChange> take_service_change() noexcept;
  /// Faults that have begun.
  [[nodiscard]] std::uint64_t begun() const noexcept { return begun_; }
  /// Faults that have changed something: a packet, a reading, the host's time.
  [[nodiscard]] std::uint64_t met() const noexcept;
  /// The begun ones, in the order of the script. Allocates.
  [[nodiscard]] std::vector<InjectedFault> injected() const;
  /// Packets of the device that faults kept from the host.
  [[nodiscard]] std::uint64_t withheld() const noexcept { return withheld_; }

 private:
  using Bytes = std::vector<std::uint8_t>;
  struct Running {
    DeviceFault fault;
    std::int64_t from = 0, to = 0;  ///< cycles of the script's clock
    bool begun = false;
    bool ended = false;  ///< of a service, and that was told
    bool begin_told = false;
    std::int64_t begun_at = 0;  ///< cycle of the device
    std::uint64_t changed = 0;
    int packets = 0;            ///< of its stream since it began
    std::int16_t stuck_at = 0;  ///< of `stick`
    int off_by = 0;             ///< of `wander`
    Bytes held{};               ///< of `freeze` and `still`: the last packet before it
  };
  /// A packet on its way.
  struct Due {
    std::int64_t at = 0;
    Bytes bytes;
  };

  [[nodiscard]] bool runs(const Running& running) const noexcept;
  /// Returns true if the running fault meets this packet of its stream.
  [[nodiscard]] bool hits(Running& running, bool of_commands) noexcept;
  /// Returns false if a fault drops the packet.
  void replace_by_old(Bytes& packet);
  bool send_on(std::span<const std::uint8_t> packet, bool of_commands, std::deque<Due>& in_flight);
  void break_sensors(Bytes& packet);
  void step_clock() noexcept;

  Emulator& device_;
  std::vector<Running> faults_;
  std::mt19937 random_;
  std::optional<std::int64_t> clock_;  ///< cycles; nothing before it starts
  std::int64_t cycle_ = 0;
  std::deque<Due> reports_, commands_;
  std::deque<Due> sent_;  ///< reports of the last `replay_cycles_`
  std::int64_t replay_cycles_ = 0;
  Bytes handed_out_;
  std::uint64_t begun_ = 0, withheld_ = 0;
};

}  // namespace kerf
