// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "hil/devmodel/device_model.hpp"
#include "hil/devmodel/wooden_arm.hpp"
#include "shared/wire/wooden_packet.hpp"

namespace kerf {

/// One WoodenHaptics arm (plans of 2015) and one hand. A count is a mA.
struct WoodenParams : PlantParams {
  WoodenParams() {
    tip_mass_kg = 0.2;
    coulomb_n = 0.2;
    for (std::size_t i = 0; i < 3; ++i) {
      torque_nmm_per_count[i] =
          wooden::kTorqueNmmPerA2015[i] / 1000.0 * (wooden::kBodyMm[i] / wooden::kCapstanMm);
    }
    on_silence = OnSilence::drop_torque;
    silence_cycles = static_cast<int>(wooden::kWatchdogS * kCyclesPerSecond);
  }
  /// What the firmware counts in the rest pose after power-up: anything, until the host sets it.
  std::array<int, 6> power_up_count{310, -220, 140, 0, 0, 0};
  /// -1: this encoder counts, and this motor turns, the other way, as in some of the makers'
  /// branches.
  std::array<int, 3> encoder_sign{1, 1, 1};
  std::size_t packet_bytes = wooden::kPacketBytes;  ///< or kLongPacketBytes
  bool wireless_button = false;                     ///< shows the hand's first button on encoder d
};

/// The WoodenHaptics arm with its firmware. From the first packet of the host on it reports every
/// 1 ms. Half a second without a packet switches the amplifiers off; the next one switches them on
/// again. The hand rests in the pose in which the arm is calibrated and presses the button; the
/// host answers by setting the encoders, for which the motors get no current.
class WoodenModel final : public DeviceModel {
 public:
  explicit WoodenModel(const WoodenParams& params = {});

  void command(const WoodenCommand& command) noexcept;
  [[nodiscard]] WoodenReport report() const noexcept;

  bool receive(std::span<const std::uint8_t> packet) noexcept override;
  void step(const HandGoal& hand) noexcept override;
  [[nodiscard]] std::span<const std::uint8_t> next_packet() noexcept override;
  [[nodiscard]] const char* name() const noexcept override { return "woodenhaptics"; }
  [[nodiscard]] bool motors_on() const noexcept override;
  [[nodiscard]] Calibration calibration() const noexcept override;
  [[nodiscard]] HandRoute route() const override;
  [[nodiscard]] const PlantState& state() const noexcept override { return plant_.state(); }
  [[nodiscard]] const PlantParams& params() const noexcept override { return params_; }

  [[nodiscard]] const WoodenArm& arm() const noexcept { return plant_.arm(); }

 private:
  /// Of the six encoders, from their zeros; this arm has no gimbal, so the last three stand still.
  [[nodiscard]] std::array<double, 6> turned_counts() const noexcept;

  WoodenParams params_;
  ArmPlant<WoodenArm> plant_;
  std::array<int, 6> zero_count_{};  ///< what the firmware shows where an encoder stands at zero
  bool streaming_ = false;
  bool due_ = false;
  bool calibrated_ = false;
  bool button_flag_ = false;
  bool button_held_ = false;
  bool button1_ = false;
  UsbFrames frames_;
  wooden::PacketBytes packet_{};
};

}  // namespace kerf
