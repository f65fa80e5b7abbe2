// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "hil/device/device_model.hpp"
#include "hil/device/plant.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/wire/falcon.hpp"

/// The emulated Novint Falcon: its kinematics, its homing, and its packets around the shared
/// mechanics.
namespace kerf {

/// The emulator's kinematics of the Falcon: double precision, from the loop of each leg.
///
/// With (u, v, w) the grip in the frame of one leg, every pose closes the loop
///
///     (u + c - a cos t)^2 + (w - a sin t)^2 = L^2,   L = d + e + sqrt(b^2 - (v + f)^2).
///
/// Joints from the tip: this is E cos t + F sin t + G = 0, solved by the half angle (Williams, "The
/// delta parallel robot", 2016). Rates and forces: its total differential, so no matrix is ever
/// inverted. The tip from joints is an iteration, for the rest pose of a new model. Any thread, no
/// state.
///
/// The real end stops are unknown: a ball of falcon::kReachMm around the origin stands for them.
/// Inside it all legs reach the grip with a bent knee; outside, the nearest angle is returned.
class FalconArm {
 public:
  [[nodiscard]] JointVec<double> joints_rad(DeviceVec<double> tip_mm) const noexcept;
  /// Newton's iteration from the middle of the workspace, in steps that all legs reach.
  [[nodiscard]] DeviceVec<double> tip_mm(JointVec<double> q) const noexcept;

  /// The force that joint torques exert at a free tip.
  [[nodiscard]] DeviceVec<double> tip_force_n(const ArmPose& pose,
                                              JointVec<double> torque_nmm) const noexcept;
  /// Joint rates of a tip velocity.
  [[nodiscard]] JointVec<double> joint_rates(const ArmPose& pose,
                                             DeviceVec<double> velocity) const noexcept;

  [[nodiscard]] static bool within_limits(DeviceVec<double> tip_mm) noexcept {
    return norm(tip_mm) <= falcon::kReachMm;
  }
  /// Puts a tip beyond the end stop back onto it and takes away the speed into the stop. Returns
  /// whether the stop was met; joints and tip then agree.
  bool stop_at_limits(JointVec<double>& q, DeviceVec<double>& tip_mm,
                      DeviceVec<double>& velocity) const noexcept;

 private:
  using Gradients = std::array<DeviceVec<double>, 3>;
  /// Of each joint angle by the tip, rad/mm.
  [[nodiscard]] static Gradients gradients(const ArmPose& pose) noexcept;
};

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
  /// Position of the grip at power-up, and at rest.
  DeviceVec<double> rest_tip_mm{0, 20, -10};
};

/// The device, its firmware running. It sends nothing of its own accord: each packet of the host
/// gets one answer, at most one per USB frame of 1 ms; the answer shows the moment at which it is
/// sent. Counts begin at zero at power-up and jump to the true ones, axis by axis, when homed. Its
/// behaviour when host packets stop is not known, so both possibilities can be tested.
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
