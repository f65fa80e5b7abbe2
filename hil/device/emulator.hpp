// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "hil/device/cartesian.hpp"
#include "hil/device/device_model.hpp"
#include "hil/device/falcon.hpp"
#include "hil/device/hand.hpp"
#include "hil/device/hand_script.hpp"
#include "hil/device/omni.hpp"
#include "hil/device/packet_device.hpp"
#include "hil/device/wooden.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {

// Every emulated device by its personality, and the emulator of one.

/// Returns `use(params)`, given the parameters of this device as it is without options:
/// `OmniParams`, `FalconParams`, `WoodenParams` or `CartesianParams`. `use` returns one type for
/// all.
template <class Use>
[[nodiscard]] auto with_device_params(Personality personality, const Use& use) {
  switch (personality) {
    case Personality::falcon:
      return use(FalconParams{});
    case Personality::woodenhaptics:
      return use(WoodenParams{});
    case Personality::inverse3:
    case Personality::touch:
    case Personality::omega:
      return use(CartesianParams(personality));
    case Personality::omni:
      break;
  }
  return use(OmniParams{});
}

[[nodiscard]] inline std::unique_ptr<DeviceModel> make_model(const OmniParams& params) {
  return std::make_unique<OmniModel>(params);
}
[[nodiscard]] inline std::unique_ptr<DeviceModel> make_model(const FalconParams& params) {
  return std::make_unique<FalconModel>(params);
}
[[nodiscard]] inline std::unique_ptr<DeviceModel> make_model(const WoodenParams& params) {
  return std::make_unique<WoodenModel>(params);
}
[[nodiscard]] inline std::unique_ptr<DeviceModel> make_model(const CartesianParams& params) {
  return std::make_unique<CartesianModel>(params);
}

/// A scene's `device.torque_scale` for these parameters: N mm per motor count of the emulated unit;
/// the true force of a Cartesian device over the commanded one.
[[nodiscard]] inline std::array<double, 3> torque_scale_of(const PlantParams& params,
                                                           Personality personality) {
  std::array<double, 3> scale = params.torque_scale();
  if (is_cartesian(personality)) {
    for (double& axis : scale) axis /= cartesian::kNewtonsPerCount;
  }
  return scale;
}
[[nodiscard]] inline std::array<double, 3> torque_scale_of(Personality personality) {
  return with_device_params(
      personality, [&](const auto& params) { return torque_scale_of(params, personality); });
}

/// Counts of a run so far.
struct EmulatorStats {
  std::int64_t cycles = 0;
  std::uint64_t reports = 0;  ///< handed out
  std::uint64_t commands = 0;
  std::uint64_t refused = 0;  ///< packets that were no commands
  double peak_motor_force_n = 0;
  double square_sum_n2 = 0;                 ///< of the motors' force, over all cycles
  double motor_work_mj = 0;                 ///< of that force on the tip
  std::optional<std::int64_t> undocked_at;  ///< bus cycle in which the arm left its rest
  std::uint64_t report_hash = kFnv1aBasis;  ///< FNV-1a of all handed-out bytes
};

/// A sine that a hand adds to the last point of its script, from its first cycle on: its value in
/// cycle n is cosine cos(n w) + sine sin(n w), device mm.
struct HandShake {
  DeviceVec<double> cosine_mm, sine_mm;
  double rad_per_cycle = 0;
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

  /// Once the script has ended the hand shakes, whoever leads it.
  void shake(const HandShake& by) noexcept { shake_ = by; }
  /// Cycles of this motion so far: the last one was n of `HandShake`.
  [[nodiscard]] std::int64_t shaken_cycles() const noexcept { return shaken_; }

  [[nodiscard]] const EmulatorStats& stats() const noexcept { return stats_; }
  [[nodiscard]] const DeviceModel& model() const noexcept { return *model_; }

 private:
  void guide_hand() noexcept;
  [[nodiscard]] HandGoal next_goal() noexcept;

  std::unique_ptr<DeviceModel> model_;
  std::optional<HandMotion> hand_;
  std::optional<GuidedHand> led_;
  std::optional<HandShake> shake_;
  std::int64_t shaken_ = 0;
  EmulatorStats stats_;
  bool asked_ = false;                      ///< for a packet, since the last `advance`
  std::optional<std::int64_t> host_since_;  ///< cycle of the first packet, of either side
  std::optional<std::int64_t> calibrated_at_;
};

}  // namespace kerf
