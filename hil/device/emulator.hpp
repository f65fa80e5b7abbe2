// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "hil/device/device_model.hpp"
#include "hil/device/hand.hpp"
#include "hil/device/hand_script.hpp"
#include "hil/device/omni.hpp"
#include "hil/device/packet_device.hpp"
#include "shared/numeric/fnv1a.hpp"

namespace kerf {

/// Counts of a run so far.
struct EmulatorStats {
  std::int64_t cycles = 0;
  std::uint64_t reports = 0;  ///< handed out
  std::uint64_t commands = 0;
  std::uint64_t refused = 0;  ///< packets that were no commands
  double peak_motor_force_n = 0;
  std::optional<std::int64_t> undocked_at;  ///< bus cycle in which the arm left its rest
  std::uint64_t report_hash = kFnv1aBasis;  ///< FNV-1a of all handed-out bytes
};

/// A device and its hand behind packets: no clock, no socket, so a front in real time, one in
/// lock-step and a test run the same code.
///
/// The hand waits until the host has calibrated the device, helps if it must (homes a Falcon,
/// presses the button of WoodenHaptics), and plays its script 50 ms later. A host that does not
/// begin to calibrate gets 2 s from its first packet, then the script begins. Without a host the
/// hand waits for ever. Without a script the arm stays in its pose. Once the script has ended, a
/// user may lead the hand (`set_target`). One thread; allocates only when constructed.
class Emulator final : public PacketDevice {
 public:
  template <std::derived_from<DeviceModel> Model>
  Emulator(std::unique_ptr<Model> model, const std::optional<HandScript>& script)
      : model_(std::move(model)) {
    if (!script) return;
    const HandRoute route = model_->route();
    hand_.emplace(*script, route);
    led_.emplace(model_->params().hand_stiffness_n_per_mm, route, hand_->start_mm());
  }
  /// An Omni.
  Emulator(const OmniParams& params, const std::optional<HandScript>& script)
      : Emulator(std::make_unique<OmniModel>(params), script) {}

  void receive(std::span<const std::uint8_t> packet) noexcept override;
  void advance(int cycles) noexcept override;
  [[nodiscard]] std::span<const std::uint8_t> next_packet() noexcept override;

  /// Returns true if a user may lead the hand: its script has ended.
  [[nodiscard]] bool accepts_target() const noexcept { return hand_ && hand_->ended(); }
  /// A user's target for the hand; `release`: the user is gone. See `GuidedHand`. While a script
  /// runs, the hand keeps to it and follows the user afterwards.
  void set_target(const HandTarget& target) noexcept;
  void release() noexcept;

  [[nodiscard]] const EmulatorStats& stats() const noexcept { return stats_; }
  [[nodiscard]] const DeviceModel& model() const noexcept { return *model_; }

 private:
  void guide_hand() noexcept;
  [[nodiscard]] HandGoal next_goal() noexcept;

  std::unique_ptr<DeviceModel> model_;
  std::optional<HandMotion> hand_;
  std::optional<GuidedHand> led_;
  EmulatorStats stats_;
  bool asked_ = false;                      ///< for a packet, since the last `advance`
  std::optional<std::int64_t> host_since_;  ///< cycle of the first packet, of either side
  std::optional<std::int64_t> calibrated_at_;
};

}  // namespace kerf
