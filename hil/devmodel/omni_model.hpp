// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <random>

#include "hil/devmodel/device_model.hpp"
#include "hil/devmodel/omni_arm.hpp"
#include "shared/wire/omni_packet.hpp"

namespace kerf {

/// One Omni and one hand.
struct OmniParams : PlantParams {
  OmniLinks links;
  std::array<double, 3> dock_rad = omni::kDockRad;
  /// Encoder counts in the inkwell after power-up: near the ends, so that they wrap in use.
  std::array<int, 3> encoder_offset{32760, -32700, 32700};
  bool pot_noise = false;  ///< replaces the low 5 bits of the pots by seeded noise
  std::uint32_t seed = 1;
};

/// The PHANTOM Omni. It has a packet whenever one is asked for. What it does when host packets stop
/// is not known, so both answers can be tested. The emulated hand takes the host for calibrated
/// once it has switched the motors on, or the light of the inkwell to steady.
class OmniModel final : public DeviceModel {
 public:
  explicit OmniModel(const OmniParams& params = {});

  /// A host packet that arrived; it acts from the next cycle on.
  void command(const OmniCommand& command) noexcept;
  /// The packet of this moment; every call counts one packet.
  [[nodiscard]] OmniReport next_report() noexcept;

  bool receive(std::span<const std::uint8_t> packet) noexcept override;
  void step(const HandGoal& hand) noexcept override;
  [[nodiscard]] std::span<const std::uint8_t> next_packet() noexcept override;
  [[nodiscard]] const char* name() const noexcept override { return "omni"; }
  [[nodiscard]] bool motors_on() const noexcept override { return command_.motors_on; }
  [[nodiscard]] Calibration calibration() const noexcept override;
  [[nodiscard]] HandRoute route() const override;
  [[nodiscard]] const PlantState& state() const noexcept override { return plant_.state(); }
  [[nodiscard]] const PlantParams& params() const noexcept override { return params_; }

  [[nodiscard]] const OmniArm& arm() const noexcept { return plant_.arm(); }
  [[nodiscard]] DeviceVec<double> dock_tip_mm() const noexcept { return plant_.rest().tip_mm; }
  [[nodiscard]] OmniCommand::Light light() const noexcept { return command_.light; }

 private:
  [[nodiscard]] std::uint16_t noisy(std::uint16_t pot) noexcept;

  OmniParams params_;
  ArmPlant<OmniArm> plant_;
  std::array<double, 3> orientation_rad_{};
  bool button1_ = false;
  bool button2_ = false;
  OmniCommand command_;
  std::uint32_t packets_ = 0;
  omni::ReportBytes packet_{};
  std::mt19937 noise_;
};

}  // namespace kerf
