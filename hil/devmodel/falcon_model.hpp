// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "hil/devmodel/device_model.hpp"
#include "hil/devmodel/falcon_arm.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/wire/falcon_constants.hpp"
#include "shared/wire/falcon_packet.hpp"

namespace kerf {

/// Homing of the Falcon's three legs: the user pulls the grip out, then pushes it in, while the
/// host asks for homing in every packet. One without that bit begins all over for the legs that are
/// not homed yet; a homed leg stays so.
///
/// At which angles a real device recognises both ends is not known; these are passed by a pull of
/// 35 mm and a push of 35 mm, 20 mm above the middle of the workspace.
class FalconHoming {
 public:
  static constexpr double kPulledOutRad = 40.0 * falcon::kRadPerDegree;
  static constexpr double kPushedInRad = 18.0 * falcon::kRadPerDegree;

  /// A packet of the host came.
  void packet(bool asks_for_homing) noexcept {
    asked_ = asks_for_homing;
    if (!asked_) pulled_out_ = {};
  }
  /// The legs stand at these angles now.
  void watch(JointVec<double> q) noexcept {
    if (!asked_) return;
    const std::array<double, 3> angle{q.x, q.y, q.z};
    for (std::size_t i = 0; i < 3; ++i) {
      if (angle[i] > kPulledOutRad) pulled_out_[i] = true;
      if (pulled_out_[i] && angle[i] < kPushedInRad) homed_[i] = true;
    }
  }

  [[nodiscard]] bool asked() const noexcept { return asked_; }
  [[nodiscard]] const std::array<bool, 3>& homed() const noexcept { return homed_; }
  [[nodiscard]] bool complete() const noexcept { return homed_[0] && homed_[1] && homed_[2]; }

 private:
  bool asked_ = false;
  std::array<bool, 3> pulled_out_{};
  std::array<bool, 3> homed_{};
};

/// One Falcon and one hand. Plausible values, to be swept; none is a claim about a unit.
struct FalconParams : PlantParams {
  FalconParams() {
    tip_mass_kg = 0.12;
    coulomb_n = 0.3;
    torque_nmm_per_count.fill(falcon::kMotorSign * falcon::kOpenDriverNmmPerCount);
  }
  /// Where the grip stands at power-up, and rests.
  DeviceVec<double> rest_tip_mm{0, 20, -10};
};

/// The Novint Falcon, its firmware running. It says nothing of its own accord: each packet of the
/// host gets one answer, at most one per USB frame of 1 ms; the answer shows the moment in which it
/// is sent. Counts begin at zero at power-up and jump to the true ones, axis by axis, when homed.
/// What it does when host packets stop is not known, so both answers can be tested.
class FalconModel final : public DeviceModel {
 public:
  explicit FalconModel(const FalconParams& params = {});

  void command(const FalconCommand& command) noexcept;
  [[nodiscard]] FalconReport report() const noexcept;

  bool receive(std::span<const std::uint8_t> packet) noexcept override;
  void step(const HandGoal& hand) noexcept override;
  [[nodiscard]] std::span<const std::uint8_t> next_packet() noexcept override;
  [[nodiscard]] const char* name() const noexcept override { return "falcon"; }
  [[nodiscard]] bool motors_on() const noexcept override { return driven_; }
  [[nodiscard]] Calibration calibration() const noexcept override;
  [[nodiscard]] HandRoute route() const override;
  [[nodiscard]] const PlantState& state() const noexcept override { return plant_.state(); }
  [[nodiscard]] const PlantParams& params() const noexcept override { return params_; }

  [[nodiscard]] const FalconArm& arm() const noexcept { return plant_.arm(); }

 private:
  /// Packets that wait in the serial buffer; more are lost.
  static constexpr int kMaxOwed = 16;

  FalconParams params_;
  ArmPlant<FalconArm> plant_;
  FalconHoming homing_;
  std::array<int, 3> power_up_count_{};
  std::uint8_t buttons_ = 0;
  bool driven_ = false;
  int owed_ = 0;  ///< answers
  bool due_ = false;
  UsbFrames frames_;
  falcon::PacketBytes packet_{};
};

}  // namespace kerf
