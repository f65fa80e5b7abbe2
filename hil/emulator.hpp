// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "hil/devmodel/hand_motion.hpp"
#include "hil/devmodel/hand_script.hpp"
#include "hil/devmodel/omni_model.hpp"
#include "hil/front/packet_device.hpp"

namespace kerf {

/// Scripted faults of the device, 0 = never.
struct EmulatorFaults {
  std::int64_t drop_every = 0;    ///< each n-th packet is lost after it was counted
  std::int64_t silent_after = 0;  ///< bus cycles; then the device says nothing any more
};

/// What a run has shown so far.
struct EmulatorStats {
  std::int64_t cycles = 0;
  std::uint64_t reports = 0;   ///< handed to the front
  std::uint64_t withheld = 0;  ///< by faults
  std::uint64_t commands = 0;
  std::uint64_t refused = 0;  ///< packets that were no commands
  double peak_motor_force_n = 0;
  std::optional<std::int64_t> undocked_at;  ///< bus cycle in which the stylus left the inkwell
  std::uint64_t report_hash = 0xCBF2'9CE4'8422'2325;  ///< FNV-1a of all handed-out bytes
};

/// The Omni, its hand and its faults behind packets: no clock, no socket, so a front in real time,
/// one in lock-step and a test run the same thing.
///
/// The hand waits in the inkwell until the host looks calibrated (steady light or motors on) for
/// 0.2 s, at most 2 s, then plays its script. Without a script the stylus stays where it is. One
/// thread; allocates only when constructed.
class Emulator final : public PacketDevice {
 public:
  Emulator(const OmniParams& params, const std::optional<HandScript>& script,
           const EmulatorFaults& faults = {});

  void receive(std::span<const std::uint8_t> packet) noexcept override;
  void advance(int cycles) noexcept override;
  [[nodiscard]] std::span<const std::uint8_t> next_packet() noexcept override;

  [[nodiscard]] const EmulatorStats& stats() const noexcept { return stats_; }
  [[nodiscard]] const OmniModel& model() const noexcept { return model_; }

 private:
  void let_hand_leave() noexcept;

  OmniModel model_;
  std::optional<HandMotion> hand_;
  EmulatorFaults faults_;
  EmulatorStats stats_;
  std::optional<std::int64_t> calibrated_at_;
  omni::ReportBytes packet_{};
};

}  // namespace kerf
